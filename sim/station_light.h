#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/image.h"
#include "base/result.h"
#include "base/transport_responses.h"
#include "sim/lit_face.h"
#include "sim/optics.h"
#include "sim/surface_reflectance.h"

namespace opaline::sim {

/// What one projector picture does to the sample, without noise and without time.
struct StationLight {
  std::vector<Rgb> patch_irradiance;  ///< E on the lit face's patches, W/mm^2
  Image<float> surface_radiance;  ///< L on the seen face's cells towards the camera, W/(mm^2 sr)
  Image<float> sensor_radiance;   ///< the same as each camera pixel sees it, PSF included
};

/// From what the light source is told to what the camera's pixels see. Const calls from any thread.
class LightPath {
 public:
  virtual ~LightPath() = default;
  virtual StationLight light(const Image<std::uint8_t>& codes) const = 0;
  /// What `light` gives in its first two fields when all is dark.
  virtual StationLight dark() const = 0;
  virtual int patches_x() const = 0;  ///< of patch_irradiance
  virtual int patches_y() const = 0;
  virtual std::string scene() const = 0;  ///< what is looked at, as JSON
  /// Which of its states the scene is in: what `light` says of a picture holds for one of them.
  virtual std::uint64_t state() const { return 0; }
  /// The lamp went dark: whoever attends the station may change the scene.
  virtual void darkened() const {}
  /// Somebody knocks against what is looked at.
  virtual void knocked() const {}
};

/// Follows light from the projector through the sample to the camera's pixels: patch irradiances
/// weight the stored responses (light adds), and every pixel averages the surface cells that its
/// area sees. Where the lit face is seen, its surface reflects some of the light at once (SurfaceOptions). Around the seen face, the block's other sides included, the camera sees black.
///
/// Threads: const, so any number at a time.
class StationOptics : public LightPath {
 public:
  StationOptics(const CameraOptics& camera,
                const ProjectorOptics& projector,
                std::shared_ptr<const TransportResponses> responses,
                const SurfaceOptions& surface = {});

  StationLight light(const Image<std::uint8_t>& codes) const override;
  StationLight dark() const override;
  int patches_x() const override { return responses_->patches_x; }
  int patches_y() const override { return responses_->patches_y; }
  std::string scene() const override { return responses_->scene; }

 private:
  Image<float> surface(const std::vector<Rgb>& patch_irradiance) const;
  void reflect(const Image<std::uint8_t>& codes, Image<float>& radiance) const;
  Image<float> seen(const Image<float>& surface) const;

  struct Share {
    std::uint32_t cell;  ///< of the seen face, row-major
    float weight;        ///< of the pixel's area
  };
  CameraOptics camera_;
  std::shared_ptr<const TransportResponses> responses_;
  LitFace patches_;
  std::optional<LitFace> cells_;            ///< of the lit face, where its surface reflects
  Image<float> reflectance_;                ///< of the seen face's surface; empty: none
  std::vector<std::uint32_t> first_share_;  ///< per pixel, and one behind the last
  std::vector<Share> shares_;
};

/// Whether responses are whole, and made for where the camera stands, to a hundredth of its distance. Errors: kInvalidArgument.
Result<void> check_responses(const TransportResponses& responses, const CameraModel& camera);

/// A picture convolved with a Gaussian, mirrored at its borders, so that no light is lost.
Image<float> blurred(const Image<float>& picture, double sigma_px);

}  // namespace opaline::sim
