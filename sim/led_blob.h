#pragma once

#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "base/events.h"
#include "sim/blob_transfer.h"
#include "sim/led_sphere.h"

namespace opaline::sim {

/// What is truly at a place of the camera's picture.
struct ObjectTruth {
  std::size_t object = 0;  ///< which ball; 0 of a body
  Vec3 point;
  Vec3 normal;
  double curvature = 0.0;  ///< mean, 1/mm
  double second = 0.0;     ///< share of the second material
  Rgb reduced_albedo{};
  Rgb diffusion_mm{};
};

/// Balls or a body, as its options say, as the truth that what is found is held against. Threads: const, any number.
class LedTruth {
 public:
  /// Errors: kInvalidArgument, kNotFound.
  static Result<LedTruth> create(const LedSphereOptions& options);
  std::optional<ObjectTruth> at(const CameraModel& camera, double x, double y) const;
  /// Where a unit vector first meets it, from outside.
  std::optional<ObjectTruth> along(Vec3 from, Vec3 way) const;
  std::size_t objects() const { return balls_.size(); }
  double radius_mm(std::size_t object) const { return balls_[object].radius_mm; }
  const LedSphereOptions& options() const { return options_; }
  const std::optional<Blob>& blob() const { return blob_; }
  BlobMaterial material(std::size_t channel) const;

 private:
  explicit LedTruth(LedSphereOptions options);
  LedSphereOptions options_;
  std::vector<BallTruth> balls_;  // of a body: one, for its radius
  std::optional<Blob> blob_;
};

/// A body of any smooth shape, of one material or of two, in the middle of a sphere of lights: LedSphere's counterpart with light traced from every
/// pixel (BlobWalk, BlobTransfer, smoothed over seven pixels), so that bumps, dents, what lies behind them and what lights itself are all in it. Lamps enter by
/// their spherical harmonics to degree 8, at their mean distance.
class LedBlob : public LightPath {
 public:
  /// Takes long and reports progress. Errors: kInvalidArgument, kNotFound, kCancelled.
  static Result<std::unique_ptr<const LightPath>> create(const LedSphereOptions& options,
                                                         const std::vector<SphereLight>& lights,
                                                         const CameraOptics& camera,
                                                         EventSink& events,
                                                         std::stop_token stop);
  ~LedBlob() override;
  StationLight light(const Image<std::uint8_t>& codes) const override;
  StationLight dark() const override;
  int patches_x() const override { return static_cast<int>(lights_.size()); }
  int patches_y() const override { return 1; }
  std::string scene() const override;
  /// Relative standard deviation of a pixel's radiance under constant light by what the paths leave; neighbours share it. Mean over the pixels, red.
  double path_noise() const { return path_noise_; }

 private:
  LedBlob(LedTruth truth, const std::vector<SphereLight>& lights, const CameraOptics& camera);
  void look(const CameraOptics& camera);
  Result<void> trace(EventSink& events, std::stop_token stop);

  LedTruth truth_;
  std::vector<SphereLight> lights_;  // as they truly are
  std::vector<SeenPlace> places_;
  std::vector<std::uint32_t> pixels_;
  std::array<std::vector<BlobTransfer>, 3> transfer_;
  int width_;
  int height_;
  double psf_sigma_px_;
  double pixel_mm_;
  double path_noise_ = 0.0;
  std::unique_ptr<const BeamLight> beam_;
};

/// LedSphere, or LedBlob where the options name a body.
Result<std::unique_ptr<const LightPath>> make_led_object(const LedSphereOptions& options,
                                                         const std::vector<SphereLight>& lights,
                                                         const CameraOptics& camera,
                                                         EventSink& events,
                                                         std::stop_token stop);

}  // namespace opaline::sim
