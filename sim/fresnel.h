#pragma once

#include <cmath>

namespace opaline::sim {

/// Reflectance of a plane boundary for unpolarised light (Fresnel; Born & Wolf, Principles of
/// Optics, 1.5.2), total internal reflection included.
///
///   r_s = (n1 c1 - n2 c2) / (n1 c1 + n2 c2),  r_p = (n1 c2 - n2 c1) / (n1 c2 + n2 c1),  R = (r_s^2
///   + r_p^2) / 2
///
/// with n1 sin1 = n2 sin2. The simulator's own: it shares no line with what is reconstructed from
/// its pictures. `cosine` is of the angle to the normal on the side the light comes from, 0 to 1;
/// `from_ior`, `to_ior` > 0.
double reflectance(double cosine, double from_ior, double to_ior);

/// The same where both cosines are known; ratio = n1 / n2.
inline double reflectance_between(double cosine, double refracted, double ratio) {
  const double s = (ratio * cosine - refracted) / (ratio * cosine + refracted);
  const double p = (ratio * refracted - cosine) / (ratio * refracted + cosine);
  return 0.5 * (s * s + p * p);
}

inline double reflectance(double cosine, double from_ior, double to_ior) {
  const double ratio = from_ior / to_ior;
  const double sine_squared = ratio * ratio * (1.0 - cosine * cosine);
  if (sine_squared >= 1.0) return 1.0;
  return reflectance_between(cosine, std::sqrt(1.0 - sine_squared), ratio);
}

}  // namespace opaline::sim
