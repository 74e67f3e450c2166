#pragma once

#include <cstdint>
#include <stop_token>
#include <vector>

#include "base/events.h"
#include "base/result.h"
#include "sim/led_blob.h"

namespace opaline::sim {

/// What the camera sees of a thin beam that enters the object where it first meets it (LedSphereOptions::beam), cross-polarised: Monte Carlo from there on, each
/// path counted in the pixel that sees where it leaves,
///
///   L = depolarised P / (N A_pixel) sum weights law(mu) / pi
///
/// P the beam's power, A_pixel the surface that the pixel sees, law that of light that arrives evenly below the surface. Threads: const, any number.
class BeamLight {
 public:
  /// Takes long and reports progress. None of `options.beam`: dark. Errors: kInvalidArgument where the beam misses the object; kCancelled.
  static Result<BeamLight> trace(const LedSphereOptions& options,
                                 const CameraOptics& camera,
                                 EventSink& events,
                                 std::stop_token stop);
  void add(double share, Image<float>& radiance) const;

 private:
  struct Lit {
    std::uint32_t pixel = 0;
    Rgb radiance{};
  };
  std::vector<Lit> lit_;
};

}  // namespace opaline::sim
