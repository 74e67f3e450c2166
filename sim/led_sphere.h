#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "base/events.h"
#include "base/light_sphere.h"
#include "base/result.h"
#include "sim/ball_response.h"
#include "sim/blob_walk.h"
#include "sim/lamp_mirror.h"
#include "sim/station_light.h"

namespace opaline::sim {

/// A thin beam of light, all channels alike, that shines where the last lamp's code says: that lamp itself stays dark.
struct LedBeam {
  Vec3 from;  ///< mm
  Vec3 aim;
  double power_w = 0.0;          ///< at full code, of each channel; > 0
  std::int64_t paths = 400'000;  ///< of each channel; >= 1000
};

/// Translucent balls side by side in the middle of a sphere of lights: centres on the x axis, in order, `gap_mm` between neighbours, all
/// together centred on the origin. They neither shade nor light each other.
struct LedSphereOptions {
  std::vector<double> radii_mm{12.0, 8.0, 5.0};  ///< 1 to 8 of them, > 0
  double gap_mm = 2.0;                           ///< >= 0
  Rgb reduced_albedo{0.985, 0.96, 0.93};         ///< alpha', 0 to 1 (excluded)
  Rgb translucency_mm{2.0, 1.4, 1.0};            ///< l_d = 1/sigma_tr, > 0
  double ior = 1.4;                              ///< 1 to 3
  double roughness =
      0.15;  ///< of the surface, GGX alpha, in parallel-polarised pictures; 0.02 to 1
  double depolarised = 0.5;  ///< share of depolarised light that passes the camera's polariser
  double intensity_error =
      0.0;  ///< relative standard deviation of the lamps from what is believed of them
  std::vector<int> dead_lights;  ///< by number from 0
  std::uint64_t seed = 1;
  std::int64_t paths = 1'000'000;  ///< of each ball and channel
  /// In place of the balls one body of this name (blob.h) and of the only radius in radii_mm; see led_blob.h for what follows.
  std::string body;
  std::int64_t paths_per_pixel = 256;  ///< of each channel; >= 16
  BlobMixture mixture = BlobMixture::kNone;
  Rgb second_reduced_albedo{0.97, 0.93, 0.9};
  Rgb second_translucency_mm{1.2, 0.9, 0.7};
  std::optional<LedBeam> beam = std::nullopt;
  double period_mm = 10.0;  ///< of bands, > 0
  double blur_mm = 1.0;     ///< of the step between halves, > 0
};
/// Errors: kInvalidArgument. `lights` is how many there are.
Result<void> validate(const LedSphereOptions& options, std::size_t lights);

/// One ball and the material of one channel, as it truly is.
struct BallTruth {
  Vec3 centre;
  double radius_mm = 0.0;
};
std::vector<BallTruth> balls_of(const LedSphereOptions& options);
/// What a camera sees at a place of its picture.
struct SeenBall {
  std::size_t ball = 0;
  Vec3 point;
  Vec3 normal;
  Vec3 to_camera;
};
std::optional<SeenBall> see_ball(const std::vector<BallTruth>& balls,
                                 const CameraModel& camera,
                                 double x,
                                 double y);
/// What is first met along a unit vector.
std::optional<SeenBall> meet_ball(const std::vector<BallTruth>& balls, Vec3 from, Vec3 way);
/// The lamps as they truly are: with their errors, and the dead ones dark.
std::vector<SphereLight> true_lamps(const LedSphereOptions& options,
                                    std::vector<SphereLight> lamps);
double diffusion_of(double reduced_albedo,
                    double translucency_mm);  ///< D = l_d sqrt(3 (1 - alpha')) / 3, mm

class BeamLight;  // led_beam.h

/// From codes of a light stage (drivers/stage_picture.h) to the camera's pixels. With u and d the direction and distance from a ball's
/// centre to a light of intensity I at `code`, n a pixel's normal, mu the cosine to the camera, and E, h a traced BallResponse,
///
///   L = depolarised h(mu) / pi sum_lights code/255 I / d^2 E(n' . u)
///
/// n' being n turned away from the camera by BallLight::tilt times the sine of their angle,
/// and with the polarisers parallel, added to it, the surface's reflection of every light after Cook and Torrance (GGX's distribution of
/// normals, Smith's shadowing, Fresnel). Pixels are sampled at their centres, then blurred by the camera's PSF. In RigTruth, `patches` are the
/// lights' irradiances in the middle, `surface_radiance` what the pixels see before the PSF.
class LedSphere : public LightPath {
 public:
  /// Traces the balls, which takes long and reports progress. Errors: kInvalidArgument, kCancelled.
  static Result<std::unique_ptr<const LedSphere>> create(const LedSphereOptions& options,
                                                         const std::vector<SphereLight>& lights,
                                                         const CameraOptics& camera,
                                                         EventSink& events,
                                                         std::stop_token stop);

  ~LedSphere() override;
  StationLight light(const Image<std::uint8_t>& codes) const override;
  StationLight dark() const override;
  int patches_x() const override { return static_cast<int>(lights_.size()); }
  int patches_y() const override { return 1; }
  std::string scene() const override;

 private:
  static constexpr std::size_t kSteps = 2048;  // of a table over cos(theta), from -1 to 1
  struct Seen : SeenBall {
    std::uint32_t pixel = 0;
  };
  struct Table {
    std::vector<float> exitance;  // kSteps + 1 times 3 channels
    std::array<BallResponse, 3> responses;
    std::array<double, 3> tilt{};
  };
  LedSphere(const LedSphereOptions& options,
            const std::vector<SphereLight>& lights,
            const CameraOptics& camera);
  void look(const CameraOptics& camera);
  Rgb diffuse(const Seen& seen, const std::vector<double>& power) const;
  MirrorSurface surface_at(const Seen& seen) const;

  LedSphereOptions options_;
  std::vector<SphereLight> lights_;  // as they truly are
  std::vector<BallTruth> balls_;
  std::vector<Table> tables_;  // one a ball
  std::vector<Seen> seen_;
  std::unique_ptr<const BeamLight> beam_;
  int width_;
  int height_;
  double psf_sigma_px_;
};

}  // namespace opaline::sim
