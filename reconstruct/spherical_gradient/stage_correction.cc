#include "reconstruct/spherical_gradient/stage_correction.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "reconstruct/diffusion/fresnel.h"
#include "reconstruct/spherical_gradient/exit_law.h"
#include "reconstruct/spherical_gradient/window_fit.h"

namespace opaline::reconstruct {
namespace {

using std::numbers::pi;

constexpr int kDegrees = 48;
constexpr std::size_t kCosines = 1024;  // of a table over n . omega, from -1 to 1
constexpr std::size_t kShapes = 64;
constexpr double kMostDamping = 2.0;
constexpr int kCurvatureHalf = 6;  // pixels: a smooth depth is enough

/// f for many dampings, as tables over the cosine, with their integrals over the sphere of f and of f cos.
class Shapes {
 public:
  explicit Shapes(double ior) {
    const std::vector<double> sharp = coefficients(ior);
    flat_ = sharp[0] / (sharp[1] / 3.0);
    for (std::size_t n = 0; n < kShapes; ++n) {
      const double damping = kMostDamping * std::pow(static_cast<double>(n) / (kShapes - 1), 2);
      for (std::size_t i = 0; i <= kCosines; ++i)
        tables_[n][i] = static_cast<float>(
            value(sharp, damping, 2.0 * static_cast<double>(i) / kCosines - 1.0));
      whole_[n] = 4.0 * pi * sharp[0];
      slanted_[n] = 4.0 * pi * sharp[1] / 3.0 / (1.0 + 2.0 * damping);
    }
  }
  /// That of a ratio r = int f / int f cos.
  std::size_t of_ratio(double ratio) const {
    const double damping = std::clamp(0.5 * (ratio / flat_ - 1.0), 0.0, kMostDamping);
    return static_cast<std::size_t>(std::lround(std::sqrt(damping / kMostDamping) * (kShapes - 1)));
  }
  double at(std::size_t shape, double cosine) const {
    const double place = (cosine + 1.0) * (0.5 * kCosines);
    const auto i = std::min(static_cast<std::size_t>(std::max(0.0, place)), kCosines - 1);
    const double part = place - static_cast<double>(i);
    const auto& table = tables_[shape];
    return table[i] + part * (table[i + 1] - table[i]);
  }
  double whole(std::size_t shape) const { return whole_[shape]; }
  double slanted(std::size_t shape) const { return slanted_[shape]; }

 private:
  /// a_l of Ft(mu) max(mu, 0) = sum a_l P_l(mu), by the midpoint rule in 4000 steps.
  static std::vector<double> coefficients(double ior) {
    constexpr int kSteps = 4000;
    std::vector<double> a(kDegrees + 1, 0.0);
    for (int i = 0; i < kSteps; ++i) {
      const double mu = (i + 0.5) / kSteps;
      const double f = (1.0 - diffusion::fresnel_reflectance(mu, ior)) * mu / kSteps;
      double before = 1.0;
      double now = mu;
      a[0] += 0.5 * f;
      a[1] += 1.5 * f * mu;
      for (int l = 2; l <= kDegrees; ++l) {
        const double next = ((2.0 * l - 1.0) * mu * now - (l - 1.0) * before) / l;
        before = now;
        now = next;
        a[static_cast<std::size_t>(l)] += (l + 0.5) * f * now;
      }
    }
    return a;
  }
  static double value(const std::vector<double>& a, double damping, double mu) {
    double before = 1.0;
    double now = mu;
    double sum = a[0] + a[1] * mu / (1.0 + 2.0 * damping);
    for (int l = 2; l <= kDegrees; ++l) {
      const double next = ((2.0 * l - 1.0) * mu * now - (l - 1.0) * before) / l;
      before = now;
      now = next;
      sum += a[static_cast<std::size_t>(l)] * now / (1.0 + l * (l + 1.0) * damping);
    }
    return sum;
  }

  double flat_ = 1.5;
  std::array<std::array<float, kCosines + 1>, kShapes> tables_{};
  std::array<double, kShapes> whole_{};
  std::array<double, kShapes> slanted_{};
};

struct Lamp {
  Vec3 position;  // along the pictures' axes, mm from what the middle of the picture sees
  std::array<double, 4> power{};  // I code/255 of the constant and of the gradients, signed
};

/// Constant and signed gradients of one pixel.
struct Measured {
  double constant = 0.0;
  std::array<double, 3> gradient{};
};

class Correction {
 public:
  Correction(const StagePictures& pictures, const StageRecord& stage, double ior)
      : p_(pictures),
        stage_(stage),
        shapes_(ior),
        law_(ior),
        surroundings_(surrounding_radiance(stage.lights, pictures.constant.codes)) {
    for (std::size_t n = 0; n < stage.lights.size(); ++n) lamps_.push_back(lamp(n));
  }

  Measured measured(std::size_t at) const {
    Measured m{p_.constant.radiance[at], {}};
    for (std::size_t a = 0; a < 3; ++a)
      m.gradient[a] = p_.minuses.empty()
                          ? 2.0 * p_.gradients[a].radiance[at] - m.constant
                          : p_.gradients[a].radiance[at] - p_.minuses[a].radiance[at];
    return m;
  }

  /// The same as ideal patterns show it, by what is known of the pixel so far.
  Measured corrected(const Measured& raw, const Measured& known, Vec3 place) const {
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
      ideal.gradient[a] = raw.gradient[a] +
                          unit * (surroundings_ * shapes_.slanted(shape) * normal[a] - sum[a + 1]);
    return ideal;
  }

  Vec3 place(int x, int y, double depth) const {
    const double nearer = stage_.distance_mm > 0.0 ? 1.0 - depth / stage_.distance_mm : 1.0;
    const double pixel = stage_.pixel_mm * nearer;
    return {(x + 0.5 - stage_.middle_x) * pixel, (y + 0.5 - stage_.middle_y) * pixel, depth};
  }
  double pixel_scale(Vec3 place, const Measured& m) const {
    if (!(stage_.distance_mm > 0.0) || !(m.gradient[2] > 0.0)) return 1.0;
    const double slanted = (place.x * m.gradient[0] + place.y * m.gradient[1]) / m.gradient[2];
    const double scale =
        (1.0 - place.z / stage_.distance_mm) * (1.0 + 0.5 * slanted / stage_.distance_mm);
    return std::clamp(scale, 0.8, 1.25);
  }
  double exit_law(double normal_z) const { return law_.at(normal_z); }
  double surroundings() const { return surroundings_; }

 private:
  Lamp lamp(std::size_t n) const {
    const SphereLight& light = stage_.lights[n];
    const Vec3 from = light.position - stage_.middle;
    Lamp lamp{{dot(from, stage_.axes[0]), dot(from, stage_.axes[1]), dot(from, stage_.axes[2])},
              {}};
    const double full = light.intensity / 255.0;
    lamp.power[0] = full * p_.constant.codes[n];
    for (std::size_t a = 0; a < 3; ++a)
      lamp.power[a + 1] = p_.minuses.empty()
                              ? full * (2.0 * p_.gradients[a].codes[n] - p_.constant.codes[n])
                              : full * (1.0 * p_.gradients[a].codes[n] - p_.minuses[a].codes[n]);
    return lamp;
  }

  const StagePictures& p_;
  const StageRecord& stage_;
  Shapes shapes_;
  ExitLaw law_;
  double surroundings_;
  std::vector<Lamp> lamps_;
};

Result<void> check(const StagePictures& p, const StageRecord& stage) {
  const auto count = static_cast<std::size_t>(std::max(0, p.width)) *
                     static_cast<std::size_t>(std::max(0, p.height));
  const auto fits = [&](const StagePictures::Picture& picture) {
    return picture.radiance.size() == count && picture.variance.size() == count &&
           picture.codes.size() == stage.lights.size();
  };
  if (count == 0 || p.measured.size() != count || !fits(p.constant) ||
      !std::ranges::all_of(p.gradients, fits) || !std::ranges::all_of(p.minuses, fits) ||
      (!p.minuses.empty() && p.minuses.size() != 3))
    return invalid_argument(
        fmt::format("pictures, mask and codes do not fit {} x {} pixels and {} lamps",
                    p.width,
                    p.height,
                    stage.lights.size()));
  if (!(surrounding_radiance(stage.lights, p.constant.codes) > 0.0))
    return invalid_argument("no lamp shines in the constant picture");
  return ok();
}

/// Heights over the object's plane, mm, by normals and mean curvature.
std::vector<float> depths(const StagePictures& p,
                          const Correction& correction,
                          double pixel_mm,
                          ThreadTeam& team) {
  PixelValues values(p.width, p.height, team);
  std::vector<float> normal_z(values.measured.size(), 0.0F);
  int left = p.width;
  int right = 0;
  for (int y = 0; y < p.height; ++y)
    for (int x = 0; x < p.width; ++x) {
      const std::size_t at = values.index(x, y);
      if (p.measured[at] != kMeasured) continue;
      const Measured m = correction.measured(at);
      const double length = std::hypot(m.gradient[0], m.gradient[1], m.gradient[2]);
      if (!(length > 0.0)) continue;
      values.normal_x[at] = static_cast<float>(m.gradient[0] / length);
      values.normal_y[at] = static_cast<float>(m.gradient[1] / length);
      normal_z[at] = static_cast<float>(m.gradient[2] / length);
      values.measured[at] = 1;
      left = std::min(left, x);
      right = std::max(right, x);
    }
  const double most = 0.5 * pixel_mm * std::max(0, right - left);
  std::vector<float> depth(values.measured.size(), 0.0F);
  for_each_window(values, kCurvatureHalf, team, [&](int x, int y, const WindowValues& w) {
    if (w.count < 6) return;
    const std::size_t at = values.index(x, y);
    const double curvature = std::max(w.curvature / pixel_mm, 1e-6);
    depth[at] = static_cast<float>(std::clamp(normal_z[at] / curvature, 0.0, most));
  });
  return depth;
}

}  // namespace

double surrounding_radiance(std::span<const SphereLight> lights,
                            std::span<const std::uint8_t> codes) {
  double sum = 0.0;
  for (std::size_t n = 0; n < lights.size(); ++n)
    sum += codes[n] / 255.0 * lights[n].intensity / dot(lights[n].position, lights[n].position);
  return sum / (4.0 * pi);
}

Result<GradientPictures> ideal_pictures(const StagePictures& p,
                                        const StageRecord& stage,
                                        double ior,
                                        ThreadTeam& team) {
  if (auto good = check(p, stage); !good) return good.error();
  const Correction correction(p, stage, ior);
  GradientPictures out{p.width, p.height, stage.pixel_mm, 1.0, {}, {}, p.measured};
  out.white = stage.depolarised * correction.surroundings();
  const std::size_t count = p.measured.size();
  for (std::size_t k = 0; k < 4; ++k) {
    out.radiance[k].assign(count, 0.0F);
    out.variance[k].assign(count, 0.0F);
  }
  out.pixel_scale.assign(count, 1.0F);
  const std::vector<float> depth = depths(p, correction, stage.pixel_mm, team);
  team.run([&](int thread) {
    for (int y = thread; y < p.height; y += team.size())
      for (int x = 0; x < p.width; ++x) {
        const std::size_t at = static_cast<std::size_t>(y) * p.width + x;
        if (p.measured[at] != kMeasured) continue;
        const Measured raw = correction.measured(at);
        const Vec3 place = correction.place(x, y, depth[at]);
        Measured ideal = raw;
        for (int round = 0; round < 2; ++round) {
          if (!(ideal.constant > 0.0) ||
              !(std::hypot(ideal.gradient[0], ideal.gradient[1], ideal.gradient[2]) > 0.0))
            break;
          ideal = correction.corrected(raw, ideal, place);
        }
        out.pixel_scale[at] = static_cast<float>(correction.pixel_scale(place, ideal));
        const double length = std::hypot(ideal.gradient[0], ideal.gradient[1], ideal.gradient[2]);
        const double law = correction.exit_law(length > 0.0 ? ideal.gradient[2] / length : 1.0);
        const double scale = raw.constant > 0.0 ? ideal.constant / raw.constant / law : 1.0 / law;
        out.radiance[0][at] = static_cast<float>(ideal.constant / law);
        out.variance[0][at] = static_cast<float>(p.constant.variance[at] * scale * scale);
        for (std::size_t a = 0; a < 3; ++a) {
          out.radiance[a + 1][at] =
              static_cast<float>(0.5 * (ideal.constant + ideal.gradient[a]) / law);
          const double variance =
              p.minuses.empty() ? p.gradients[a].variance[at]
                                : 0.25 * (p.gradients[a].variance[at] + p.minuses[a].variance[at]);
          out.variance[a + 1][at] = static_cast<float>(variance / (law * law));
        }
      }
  });
  return out;
}

}  // namespace opaline::reconstruct
