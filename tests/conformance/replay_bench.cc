#include "base/clock.h"
#include "drivers/replay/replay_camera.h"
#include "drivers/replay/replay_projector.h"
#include "tests/conformance/device_bench.h"
#include "tests/support/photograph_folder.h"
#include "tests/support/temporary_directory.h"

namespace opaline::conformance {
namespace {

/// A folder of photographs; unplugging renames it, as a disk that goes away would.
class ReplayBench : public DeviceBench {
 public:
  ReplayBench() { support::write_photographs(folder_); }
  drivers::Camera& camera() override { return camera_; }
  drivers::Projector& projector() override { return projector_; }
  void unplug_camera() override { std::filesystem::rename(folder_, away_); }
  bool can_unplug_projector() const override { return false; }
  void plug() override { std::filesystem::rename(away_, folder_); }
  bool keeps_time() const override { return false; }

 private:
  testing::TemporaryDirectory directory_;
  std::filesystem::path folder_ = directory_.path() / "photographs";
  std::filesystem::path away_ = directory_.path() / "away";
  SystemClock clock_;
  drivers::ReplayCamera camera_{folder_, clock_};
  drivers::ReplayProjector projector_{folder_};
};

}  // namespace

std::unique_ptr<DeviceBench> make_replay_bench() { return std::make_unique<ReplayBench>(); }

}  // namespace opaline::conformance
