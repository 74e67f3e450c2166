#include "sim/blob.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "base/ensure.h"
#include "sim/hash.h"

namespace opaline::sim {
namespace {

constexpr double kMostDent = 0.6;
constexpr double kLeastStep = 2e-4;  // of the radius
constexpr double kSlopeOfBell =
    0.75;  // most of w d/dtheta exp((cos theta - 1)/w^2), w <= 3: 0.61 for narrow ones

/// (1 - t/8)^7, B over what is left of 1 - t/8.
double seventh(double rest) {
  const double square = rest * rest;
  return square * square * square * rest;
}
double rest_of_bell(const BlobLobe& lobe, double cosine) {
  return std::max(0.0, 1.0 - (1.0 - cosine) / (8.0 * lobe.width * lobe.width));
}

}  // namespace

Result<void> validate(const BlobShape& shape) {
  if (!(shape.radius_mm > 0.0 && std::isfinite(shape.radius_mm)))
    return invalid_argument(fmt::format("radius of {} mm; expected > 0", shape.radius_mm));
  double deepest = 0.0;
  for (const BlobLobe& lobe : shape.lobes) {
    if (!(std::abs(length(lobe.towards) - 1.0) < 1e-6) ||
        !(lobe.width >= 0.1 && lobe.width <= 3.0) || !(std::abs(lobe.height) <= 2.0))
      return invalid_argument(
          "a lobe; expected a unit vector, a width of 0.1 to 3 and a height within 2 radii");
    deepest -= std::min(0.0, lobe.height);
  }
  if (deepest > kMostDent)
    return invalid_argument(
        fmt::format("dents of {} radii together; expected at most {}", deepest, kMostDent));
  return ok();
}

Blob::Blob(BlobShape shape)
    : shape_(std::move(shape)),
      inner_mm_(1.0),
      outer_mm_(1.0),
      steepness_(0.0),
      step_(kLeastStep * shape_.radius_mm) {
  ENSURE(validate(shape_));
  double slope = 0.0;
  for (const BlobLobe& lobe : shape_.lobes) {
    inner_mm_ += std::min(0.0, lobe.height);
    outer_mm_ += std::max(0.0, lobe.height);
    slope += std::abs(lobe.height) * kSlopeOfBell / lobe.width;
  }
  steepness_ = std::hypot(1.0, slope / (0.5 * inner_mm_));
  inner_mm_ *= shape_.radius_mm;
  outer_mm_ *= shape_.radius_mm;
}

double Blob::radius_towards(Vec3 unit) const {
  double sum = 1.0;
  for (const BlobLobe& lobe : shape_.lobes) {
    const double rest = rest_of_bell(lobe, dot(unit, lobe.towards));
    sum += lobe.height * rest * seventh(rest);
  }
  return shape_.radius_mm * sum;
}

double Blob::height(Vec3 at) const {
  const double far = length(at);
  return far > 0.0 ? far - radius_towards(at * (1.0 / far)) : -inner_mm_;
}

double Blob::clearance(Vec3 at) const {
  const double far = length(at);
  const double within = inner_mm_ - far;
  if (within > 0.25 * inner_mm_) return within;
  const double off = std::abs(far - radius_towards(at * (1.0 / far))) / steepness_;
  return std::max(within, std::min(off, far - 0.5 * inner_mm_));
}

Vec3 Blob::normal(Vec3 at) const {
  const double far = length(at);
  const Vec3 unit = at * (1.0 / far);
  Vec3 gradient = unit;
  for (const BlobLobe& lobe : shape_.lobes) {
    const double cosine = dot(unit, lobe.towards);
    const double slope = shape_.radius_mm * lobe.height / (lobe.width * lobe.width) *
                         seventh(rest_of_bell(lobe, cosine));
    gradient = gradient - (lobe.towards - unit * cosine) * (slope / far);
  }
  return normalized(gradient);
}

double Blob::mean_curvature(Vec3 at) const {
  const double h = 1e-4 * shape_.radius_mm;
  const double x = normal(at + Vec3{h, 0, 0}).x - normal(at - Vec3{h, 0, 0}).x;
  const double y = normal(at + Vec3{0, h, 0}).y - normal(at - Vec3{0, h, 0}).y;
  const double z = normal(at + Vec3{0, 0, h}).z - normal(at - Vec3{0, 0, h}).z;
  return 0.25 * (x + y + z) / h;
}

/// The crossing between two places of a ray, by the false position (Illinois).
double Blob::refined(Vec3 from, Vec3 way, double before, double after) const {
  double low = height(from + way * before);
  double high = height(from + way * after);
  for (int round = 0; round < 30 && after - before > 1e-3 * step_; ++round) {
    const double middle = before - low * (after - before) / (high - low);
    const double there = height(from + way * middle);
    if ((there < 0.0) == (low < 0.0)) {
      before = middle;
      low = there;
      high *= 0.5;
    } else {
      after = middle;
      high = there;
      low *= 0.5;
    }
    if (std::abs(there) < 1e-3 * step_) return middle;
  }
  return 0.5 * (before + after);
}

std::optional<double> Blob::leaves(Vec3 from, Vec3 way, double reach) const {
  double along = 0.0;
  if (length(from) + reach < inner_mm_) return std::nullopt;
  for (;;) {
    const Vec3 at = from + way * along;
    const double clear = clearance(at);
    if (along + clear >= reach) return std::nullopt;
    const double next = std::min(reach, along + std::max(step_, clear));
    if (clear < step_ && height(from + way * next) >= 0.0) return refined(from, way, along, next);
    along = next;
    if (along >= reach) return std::nullopt;
  }
}

std::optional<double> Blob::meets(Vec3 from, Vec3 way) const {
  const double towards = -dot(from, way);
  const double root = towards * towards - dot(from, from) + outer_mm_ * outer_mm_;
  if (root <= 0.0) return std::nullopt;
  const double end = towards + std::sqrt(root);
  double along = std::max(0.0, towards - std::sqrt(root));
  while (along < end) {
    const double clear = clearance(from + way * along);
    const double next = along + std::max(step_, clear);
    if (clear < step_ && height(from + way * next) < 0.0) return refined(from, way, along, next);
    along = next;
  }
  return std::nullopt;
}

Result<BlobShape> blob_of_name(std::string_view name, double radius_mm) {
  const auto lobe = [](Vec3 towards, double height, double width) {
    return BlobLobe{normalized(towards), height, width};
  };
  if (name == "ball") return BlobShape{radius_mm, {}};
  if (name == "blob_a")
    return BlobShape{radius_mm,
                     {lobe({0.7, 0.2, 0.6}, 0.12, 0.7),
                      lobe({-0.6, 0.5, 0.5}, 0.10, 0.6),
                      lobe({-0.2, -0.8, 0.4}, 0.14, 0.8)}};
  if (name == "blob_b")
    return BlobShape{radius_mm,
                     {lobe({0.8, 0.3, 0.3}, 0.35, 0.6),
                      lobe({-0.7, 0.4, 0.4}, 0.25, 0.6),
                      lobe({0.1, -0.1, 1.0}, -0.12, 0.35)}};
  if (name == "dent") return BlobShape{radius_mm, {lobe({0.15, 0.1, 1.0}, -0.3, 0.4)}};
  if (name == "blob_c") return blob_of_seed(3, radius_mm);
  if (name == "blob_d") return blob_of_seed(4, radius_mm);
  return not_found(fmt::format("no body \"{}\"; there are {}", name, fmt::join(kBodyNames, ", ")));
}

BlobShape blob_of_seed(std::uint64_t seed, double radius_mm) {
  constexpr int kLobes = 6;
  BlobShape shape{radius_mm, {}};
  for (std::uint64_t n = 0; n < kLobes; ++n) {
    const auto draw = [&](std::uint64_t k) {
      return uniform(mix(mix(seed, 0x626c6f62), 8 * n + k));
    };
    const double z = draw(0);
    const double turn = 2.0 * std::numbers::pi * draw(1);
    const double across = std::sqrt(1.0 - z * z);
    shape.lobes.push_back({normalized({across * std::cos(turn), across * std::sin(turn), z}),
                           -0.08 + 0.28 * draw(2),
                           0.5 + 0.5 * draw(3)});
  }
  return shape;
}

}  // namespace opaline::sim
