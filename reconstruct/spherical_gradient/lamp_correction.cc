#include "reconstruct/spherical_gradient/lamp_correction.h"

namespace opaline::reconstruct {

LampCorrection::LampCorrection(const StagePictures& pictures, const StageRecord& stage, double ior)
    : p_(pictures),
      stage_(stage),
      shapes_(ior),
      law_(ior),
      surroundings_(surrounding_radiance(stage.lights, pictures.constant.codes)) {
  for (std::size_t n = 0; n < stage.lights.size(); ++n) lamps_.push_back(lamp(n));
}

Measured LampCorrection::corrected(const Measured& raw, const Measured& known, Vec3 place) const {
  const double length = std::hypot(known.gradient[0], known.gradient[1], known.gradient[2]);
  const std::array<double, 3> normal{
      known.gradient[0] / length, known.gradient[1] / length, known.gradient[2] / length};
  const std::size_t shape = shapes_.of_ratio(known.constant / length);
  std::array<double, 4> sum{};
  for (const Lamp& lamp : lamps_) {
    const Vec3 to = lamp.position - place;
    const double square = dot(to, to);
    const double inverse = 1.0 / std::sqrt(square);
    const double cosine = (to.x * normal[0] + to.y * normal[1] + to.z * normal[2]) * inverse;
    const double f = shapes_.at(shape, cosine) / square;
    for (std::size_t k = 0; k < 4; ++k) sum[k] += lamp.power[k] * f;
  }
  const double unit = raw.constant / sum[0];
  Measured ideal{unit * surroundings_ * shapes_.whole(shape), {}};
  for (std::size_t a = 0; a < 3; ++a)
    ideal.gradient[a] =
        raw.gradient[a] + unit * (surroundings_ * shapes_.slanted(shape) * normal[a] - sum[a + 1]);
  return ideal;
}

Measured LampCorrection::corrected_twice(const Measured& raw, Vec3 place) const {
  Measured ideal = raw;
  for (int round = 0; round < 2; ++round) {
    if (!(ideal.constant > 0.0) || !(length_of(ideal) > 0.0)) break;
    ideal = corrected(raw, ideal, place);
  }
  return ideal;
}

LinearCorrection LampCorrection::linear(const Measured& mean, Vec3 place) const {
  const Measured known = corrected(mean, mean, place);
  LinearCorrection c{normal_of(known), {}, {}};
  const std::size_t shape = shapes_.of_ratio(known.constant / length_of(known));
  std::array<double, 4> sum{};
  std::array<Vec3, 4> turn{};  // its gradient by the normal
  for (const Lamp& lamp : lamps_) {
    const Vec3 to = lamp.position - place;
    const double square = dot(to, to);
    const Vec3 way = to * (1.0 / std::sqrt(square));
    const double cosine = dot(way, c.normal);
    const double f = shapes_.at(shape, cosine) / square;
    const Vec3 by_normal = way * (shapes_.slope(shape, cosine) / square);
    for (std::size_t k = 0; k < 4; ++k) {
      sum[k] += lamp.power[k] * f;
      turn[k] = turn[k] + by_normal * lamp.power[k];
    }
  }
  const double each = 1.0 / sum[0];
  const double slanted = surroundings_ * shapes_.slanted(shape);
  c.value[0] = surroundings_ * shapes_.whole(shape) * each;
  c.slope[0] = turn[0] * (-c.value[0] * each);
  constexpr std::array kAxes{Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}};
  for (std::size_t a = 0; a < 3; ++a) {
    c.value[a + 1] = (slanted * dot(kAxes[a], c.normal) - sum[a + 1]) * each;
    c.slope[a + 1] = (kAxes[a] * slanted - turn[a + 1] - turn[0] * c.value[a + 1]) * each;
  }
  return c;
}

Measured LampCorrection::corrected(const Measured& raw, const LinearCorrection& c) {
  Measured ideal = raw;
  for (int round = 0; round < 2; ++round) {
    if (!(length_of(ideal) > 0.0)) return ideal;
    const Vec3 n = normal_of(ideal);
    ideal.constant = raw.constant * c.at(0, n);
    for (std::size_t a = 0; a < 3; ++a)
      ideal.gradient[a] = raw.gradient[a] + raw.constant * c.at(a + 1, n);
  }
  return ideal;
}

LampCorrection::Lamp LampCorrection::lamp(std::size_t n) const {
  const SphereLight& light = stage_.lights[n];
  const Vec3 from = light.position - stage_.middle;
  Lamp lamp{{dot(from, stage_.axes[0]), dot(from, stage_.axes[1]), dot(from, stage_.axes[2])}, {}};
  const double full = light.intensity / 255.0;
  lamp.power[0] = full * p_.constant.codes[n];
  for (std::size_t a = 0; a < 3; ++a)
    lamp.power[a + 1] = p_.minuses.empty()
                            ? full * (2.0 * p_.gradients[a].codes[n] - p_.constant.codes[n])
                            : full * (1.0 * p_.gradients[a].codes[n] - p_.minuses[a].codes[n]);
  return lamp;
}

}  // namespace opaline::reconstruct
