#pragma once

#include <cstdint>
#include <optional>

#include "base/pose.h"
#include "sim/ball_walk.h"
#include "sim/blob.h"

namespace opaline::sim {

/// How a body's second material lies among its first.
enum class BlobMixture : std::uint8_t {
  kNone,    ///< it does not
  kHalves,  ///< to the right of the middle, over a smooth step
  kBands,   ///< a sine along x: half and half in between
};

/// Coefficients of one channel, after similarity: isotropic scattering.
struct BlobCoefficients {
  double extinction = 2.0;       ///< sigma_t', 1/mm, > 0
  double reduced_albedo = 0.95;  ///< alpha', 0 to 1
};

/// One channel of a body: sigma_a and sigma_s' of two materials, mixed linearly by a share that varies smoothly over `blur_mm`.
struct BlobMaterial {
  BlobCoefficients first;
  BlobCoefficients second;
  BlobMixture mixture = BlobMixture::kNone;
  double period_mm = 10.0;  ///< of bands
  double blur_mm = 1.0;     ///< of the step between halves
  double ior = 1.4;

  double share(Vec3 at) const;  ///< of the second, 0 to 1
  BlobCoefficients at(Vec3 place) const;
};

/// Monte Carlo from the camera into a body and out to where the light came from; by reciprocity the radiance that leaves along a ray is the
/// mean of weight times the radiance that arrives from `way`. Free paths by delta tracking (Woodcock 1965), Fresnel's chance at the surface on both
/// sides; light that leaves and meets the body elsewhere goes in again (interreflection). Cross-polarised: a path that has not scattered twice
/// ends without weight.
class BlobWalk {
 public:
  struct Origin {
    double weight = 0.0;
    Vec3 from;  ///< on the surface
    Vec3 way;   ///< to where the light came from, unit vector
  };
  BlobWalk(const Blob& blob, const BlobMaterial& material);  ///< `blob` outlives the walk

  std::optional<Origin> trace(Vec3 surface,
                              Vec3 normal,
                              Vec3 to_camera,
                              PathNumbers& numbers) const;

 private:
  struct State {
    Vec3 at;
    Vec3 way;
    double weight = 1.0;
    int collisions = 0;
    bool inside = true;
  };
  void scatter(State& state, PathNumbers& numbers) const;
  void reach_surface(State& state, PathNumbers& numbers) const;
  bool go_outside(State& state, PathNumbers& numbers) const;

  const Blob& blob_;
  BlobMaterial material_;
  double majorant_;
  double nudge_;
};

}  // namespace opaline::sim
