#include "drivers/udmx/udmx_stage.h"
#include "tests/conformance/stage_bench.h"
#include "tests/support/fake_udmx.h"

namespace opaline::conformance {
namespace {

class UdmxBench : public StageBench {
 public:
  drivers::LightStage& stage() override { return stage_; }
  void unplug() override { world_.plug(false); }
  void plug() override { world_.plug(true); }
  bool is_dark() override { return world_.is_dark(); }

 private:
  static drivers::UdmxOptions options() {
    drivers::UdmxOptions options;
    options.lights = light_sphere(600, 500.0, 0.5);
    return options;
  }
  support::FakeUdmx world_{{"1-1", "1-2"}};
  drivers::UdmxStage stage_{options(), world_.bus()};
};

}  // namespace

std::unique_ptr<StageBench> make_udmx_bench() { return std::make_unique<UdmxBench>(); }

}  // namespace opaline::conformance
