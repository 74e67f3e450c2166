#include "reconstruct/spherical_gradient/stage_correction.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "reconstruct/spherical_gradient/lamp_correction.h"
#include "reconstruct/spherical_gradient/picture_arrays.h"
#include "reconstruct/spherical_gradient/window_fit.h"

namespace opaline::reconstruct {
namespace {

using std::numbers::pi;

constexpr double kBlockAngle = 0.01;  // radians that normals turn by within a block
constexpr int kLargestBlock = 16;     // pixels
constexpr std::size_t kSampleStep = 97;
constexpr int kCurvatureHalf = 6;  // pixels: a smooth depth is enough

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

/// Heights over the object's plane, mm, by normals and mean curvature; and that curvature, 1/pixel, of some of the pixels.
struct Depths {
  std::vector<float> depth;
  std::vector<float> some_curvatures;
};
Depths depths(const StagePictures& p,
              const LampCorrection& correction,
              double pixel_mm,
              ThreadTeam& team) {
  PixelValues values(p.width, p.height, team);
  const std::size_t count = values.measured.size();
  Depths d;
  std::vector<float> normal_z;
  assign_zeros({&d.depth, &normal_z}, count, team);
  d.some_curvatures.assign(count / kSampleStep + 1, 0.0F);
  std::vector<int> lefts(static_cast<std::size_t>(team.size()), p.width);
  std::vector<int> rights(lefts.size(), 0);
  team.run([&](int thread) {
    int left = p.width;
    int right = 0;
    for (int y = thread; y < p.height; y += team.size())
      for (int x = 0; x < p.width; ++x) {
        const std::size_t at = values.index(x, y);
        if (p.measured[at] != kMeasured) continue;
        const Measured m = correction.measured(at);
        const double length = length_of(m);
        if (!(length > 0.0)) continue;
        values.normal_x[at] = static_cast<float>(m.gradient[0] / length);
        values.normal_y[at] = static_cast<float>(m.gradient[1] / length);
        normal_z[at] = static_cast<float>(m.gradient[2] / length);
        values.measured[at] = 1;
        left = std::min(left, x);
        right = std::max(right, x);
      }
    lefts[static_cast<std::size_t>(thread)] = left;
    rights[static_cast<std::size_t>(thread)] = right;
  });
  const int across = *std::ranges::max_element(rights) - *std::ranges::min_element(lefts);
  const double most = 0.5 * pixel_mm * std::max(0, across);
  for_each_window(values, kCurvatureHalf, team, [&](int x, int y, const WindowValues& w) {
    if (w.count < 6) return;
    const std::size_t at = values.index(x, y);
    const double curvature = std::max(w.curvature / pixel_mm, 1e-6);
    d.depth[at] = static_cast<float>(std::clamp(normal_z[at] / curvature, 0.0, most));
    if (at % kSampleStep == 0) d.some_curvatures[at / kSampleStep] = w.curvature;
  });
  return d;
}

/// Pixels within which normals turn little, by the median of the curvatures; a power of two.
int side_of_block(std::vector<float> curvatures) {
  std::erase(curvatures, 0.0F);
  if (curvatures.empty()) return 1;
  const auto middle = curvatures.begin() + std::ssize(curvatures) / 2;
  std::ranges::nth_element(curvatures, middle);
  int side = 1;
  while (side < kLargestBlock && 2.0 * side * *middle <= kBlockAngle) side *= 2;
  return side;
}

/// Writes ideal pictures, block after block.
class IdealWriter {
 public:
  IdealWriter(const StagePictures& p,
              const LampCorrection& correction,
              const std::vector<float>& depth,
              GradientPictures& out)
      : p_(p), correction_(correction), depth_(depth), out_(out) {}

  void pixel(int x, int y) {
    const std::size_t at = index(x, y);
    if (p_.measured[at] != kMeasured) return;
    const Measured raw = correction_.measured(at);
    const Vec3 place = correction_.place(x, y, depth_[at]);
    put(at, raw, correction_.corrected_twice(raw, place), place);
  }
  void block(int left, int top, int side) {
    const int right = std::min(p_.width, left + side);
    const int bottom = std::min(p_.height, top + side);
    Measured mean;
    Vec3 place;
    double count = 0.0;
    for (int y = top; y < bottom; ++y)
      for (int x = left; x < right; ++x) {
        const std::size_t at = index(x, y);
        if (p_.measured[at] != kMeasured) continue;
        const Measured raw = correction_.measured(at);
        mean.constant += raw.constant;
        for (std::size_t a = 0; a < 3; ++a) mean.gradient[a] += raw.gradient[a];
        place = place + correction_.place(x, y, depth_[at]);
        count += 1.0;
      }
    if (count == 0.0) return;
    if (!(mean.constant > 0.0) || !(length_of(mean) > 0.0)) {
      for (int y = top; y < bottom; ++y)
        for (int x = left; x < right; ++x) pixel(x, y);
      return;
    }
    const LinearCorrection linear = correction_.linear(mean, place * (1.0 / count));
    for (int y = top; y < bottom; ++y)
      for (int x = left; x < right; ++x) {
        const std::size_t at = index(x, y);
        if (p_.measured[at] != kMeasured) continue;
        const Measured raw = correction_.measured(at);
        put(at, raw, LampCorrection::corrected(raw, linear), correction_.place(x, y, depth_[at]));
      }
  }

 private:
  std::size_t index(int x, int y) const { return static_cast<std::size_t>(y) * p_.width + x; }
  void put(std::size_t at, const Measured& raw, const Measured& ideal, Vec3 place) {
    out_.pixel_scale[at] = static_cast<float>(correction_.pixel_scale(place, ideal));
    const double length = length_of(ideal);
    const double law = correction_.exit_law(length > 0.0 ? ideal.gradient[2] / length : 1.0);
    const double scale = raw.constant > 0.0 ? ideal.constant / raw.constant / law : 1.0 / law;
    out_.radiance[0][at] = static_cast<float>(ideal.constant / law);
    out_.variance[0][at] = static_cast<float>(p_.constant.variance[at] * scale * scale);
    for (std::size_t a = 0; a < 3; ++a) {
      out_.radiance[a + 1][at] =
          static_cast<float>(0.5 * (ideal.constant + ideal.gradient[a]) / law);
      const double variance =
          p_.minuses.empty() ? p_.gradients[a].variance[at]
                             : 0.25 * (p_.gradients[a].variance[at] + p_.minuses[a].variance[at]);
      out_.variance[a + 1][at] = static_cast<float>(variance / (law * law));
    }
  }

  const StagePictures& p_;
  const LampCorrection& correction_;
  const std::vector<float>& depth_;
  GradientPictures& out_;
};

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
  const LampCorrection correction(p, stage, ior);
  GradientPictures out{p.width, p.height, stage.pixel_mm, 1.0, {}, {}, p.measured};
  out.white = stage.depolarised * correction.surroundings();
  assign_zeros({&out.radiance[0],
                &out.radiance[1],
                &out.radiance[2],
                &out.radiance[3],
                &out.variance[0],
                &out.variance[1],
                &out.variance[2],
                &out.variance[3]},
               p.measured.size(),
               team);
  out.pixel_scale.assign(p.measured.size(), 1.0F);
  const Depths d = depths(p, correction, stage.pixel_mm, team);
  const int side = side_of_block(d.some_curvatures);
  team.run([&](int thread) {
    IdealWriter writer(p, correction, d.depth, out);
    for (int top = thread * side; top < p.height; top += team.size() * side)
      for (int left = 0; left < p.width; left += side)
        side == 1 ? writer.pixel(left, top) : writer.block(left, top, side);
  });
  return out;
}

}  // namespace opaline::reconstruct
