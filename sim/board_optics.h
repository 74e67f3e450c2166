#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "sim/board_scene.h"
#include "sim/optics.h"
#include "sim/station_light.h"

namespace opaline::sim {

/// A board in front of camera and projector as another light path of the rig. A camera pixel is the mean over 2 x 2 places in it; of
/// each the ray's point p of the board, its albedo a, and the projector's picture there tell
///
///   L = a / pi . peak . (reference / d)^2 . cos(theta) . vignetting . (black_level + (1 - black_level) (code/255)^gamma)
///
/// with d the distance from the projector and theta the angle at which its light falls; then the lens blurs it. Light that goes from the
/// board to itself or past it is left out.
///
/// The board is held by an operator who takes the next pose whenever the lamp goes dark. In RigTruth, `scene` has the pose, `patches`
/// and `surface_radiance` are one dark cell.
///
/// Threads: const calls from any thread.
class BoardOptics : public LightPath {
 public:
  /// The projector's lens and picture are of one size.
  BoardOptics(const CameraOptics& camera,
              const ProjectorOptics& projector,
              const BoardSceneOptions& scene);

  StationLight light(const Image<std::uint8_t>& codes) const override;
  StationLight dark() const override;
  int patches_x() const override { return 1; }
  int patches_y() const override { return 1; }
  std::string scene() const override;
  std::uint64_t state() const override { return state_.load(); }
  void darkened() const override { state_ += kNextPose; }
  void knocked() const override { state_ += 1; }

  /// The same of a given pose, whatever the operator holds.
  StationLight light_of(const SimBoardPose& pose, const Image<std::uint8_t>& codes) const;
  SimBoardPose held() const { return held(state_.load()); }

 private:
  static constexpr std::uint64_t kNextPose = std::uint64_t{1} << 16;  // nudges are counted below it
  struct Place {
    float albedo = 0.0f;  // times geometry, over pi
    float x = 0.0f;       // of the projector's picture
    float y = 0.0f;
  };
  struct Look {
    std::vector<Place> places;
    double blur_px = 0.0;
  };
  SimBoardPose held(std::uint64_t state) const;
  Look look(const SimBoardPose& pose) const;
  StationLight lit(const Look& look, const Image<std::uint8_t>& codes) const;
  Image<float> projected(const Image<std::uint8_t>& codes) const;

  CameraOptics camera_;
  ProjectorOptics projector_;
  BoardSceneOptions scene_;
  std::vector<float> rays_;  // x, y of z = 1, in the camera's frame, of each place
  Image<float> projector_vignetting_;
  mutable std::atomic<std::uint64_t> state_{0};
  mutable std::mutex mutex_;
  mutable std::uint64_t looked_at_ = ~std::uint64_t{0};  // guarded by mutex_
  mutable std::shared_ptr<const Look> look_;             // guarded by mutex_
};

}  // namespace opaline::sim
