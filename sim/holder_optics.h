#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "base/result.h"
#include "sim/board_optics.h"
#include "sim/board_scene.h"
#include "sim/station_light.h"

namespace opaline::sim {

/// What a sample lies in: a frame of opal acrylic with a ChArUco board printed on it, whose middle is cut out for the sample.
struct HolderScene {
  SimBoard board{.kind = SimBoardKind::kCharuco,
                 .squares_y = 10,
                 .square_mm = 4.4,
                 .marker_mm = 3.1,
                 .margin_mm = 1.0};
  Pose sample_from_board;
  double glow =
      0.5;  ///< of the irradiance that falls beside the sample, what leaves its front as exitance; 0 to 1
};
Result<void> validate(const HolderScene& holder);

/// What a holder adds its own light to.
class HeldSample : public LightPath {
 public:
  StationLight dark() const override { return sample_.dark(); }
  int patches_x() const override { return sample_.patches_x(); }
  int patches_y() const override { return sample_.patches_y(); }
  std::string scene() const override { return sample_.scene(); }

 protected:
  explicit HeldSample(StationOptics sample) : sample_(std::move(sample)) {}
  StationOptics sample_;
};

/// A sample in its holder, lit from behind. The projector's light that falls beside the sample, on average over there, spreads in the acrylic and leaves
/// it evenly: a camera pixel that sees the board's plane outside the sample's seen face has
///
///   L = a / pi . glow . mean irradiance beside the sample
///
/// with a the albedo there, the mean of 2 x 2 places in the pixel; then the lens blurs it. Lights on the sample alone leave it dark.
/// The sample sheds no light on it, nor it on the sample.
///
/// Threads: const, so any number at a time.
class HolderOptics : public HeldSample {
 public:
  HolderOptics(const CameraOptics& camera,
               const ProjectorOptics& projector,
               std::shared_ptr<const TransportResponses> responses,
               const HolderScene& holder,
               const SurfaceOptions& surface = {});

  StationLight light(const Image<std::uint8_t>& codes) const override;

 private:
  Rgb beside(const Image<std::uint8_t>& codes) const;

  CameraOptics camera_;
  ProjectorOptics projector_;
  double glow_;
  Image<std::uint8_t> is_beside_;  // 1: a projector pixel whose middle does not fall on the sample
  Image<float> albedo_;            // over pi, as the camera's pixels see it, blurred
  Image<float> vignetting_;
};

/// The same in front of camera and projector both, the latter in perspective: its light falls on the printed board, which is matt (board_optics.h).
/// Holder and sample shed no light on each other.
///
/// Threads: const, so any number at a time.
class LitHolderOptics : public HeldSample {
 public:
  LitHolderOptics(const CameraOptics& camera,
                  const ProjectorOptics& projector,
                  std::shared_ptr<const TransportResponses> responses,
                  const HolderScene& holder,
                  const SurfaceOptions& surface = {});

  StationLight light(const Image<std::uint8_t>& codes) const override;

 private:
  BoardOptics holder_;
};

}  // namespace opaline::sim
