#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "base/pose.h"
#include "base/result.h"

namespace opaline::sim {

/// A bump or a dent: it lifts the surface by `height` of the body's radius in one direction, and fades as a bell over `width`.
struct BlobLobe {
  Vec3 towards{0.0, 0.0, 1.0};  ///< unit vector
  double height = 0.0;          ///< of the radius; negative: a dent
  double width = 0.5;           ///< radians, 0.1 to 3
};

/// A smooth closed body around the origin that every direction meets once:
///
///   r(u) = R (1 + sum_k h_k B((1 - u . c_k) / w_k^2)),     B(t) = max(0, 1 - t/8)^8, close to e^-t;  u a unit vector
struct BlobShape {
  double radius_mm = 10.0;  ///< R, > 0
  std::vector<BlobLobe> lobes;
};
/// Errors: kInvalidArgument, also where dents add up to more than 60 % of the radius.
Result<void> validate(const BlobShape& shape);

/// Where a body's surface is. ENSUREs a valid shape. Threads: const, any number.
class Blob {
 public:
  explicit Blob(BlobShape shape);

  double radius_towards(Vec3 unit) const;  ///< mm
  double height(Vec3 at) const;            ///< |p| - r(p/|p|), mm; < 0 inside
  double clearance(Vec3 at) const;         ///< mm around a point in which there is no surface
  Vec3 normal(Vec3 at) const;              ///< outward, of the level surface of height() there
  /// Half of the normals' divergence, 1/mm, 1/R on a ball: a central difference.
  double mean_curvature(Vec3 at) const;

  /// Along a unit vector from a point inside: where the surface is, none within `reach`.
  std::optional<double> leaves(Vec3 from, Vec3 way, double reach) const;
  /// From a point outside: where the body is met.
  std::optional<double> meets(Vec3 from, Vec3 way) const;

  const BlobShape& shape() const { return shape_; }
  double outer_mm() const { return outer_mm_; }  ///< of a ball that holds the body

 private:
  double refined(Vec3 from, Vec3 way, double before, double after) const;

  BlobShape shape_;
  double inner_mm_;  // of a ball within it
  double outer_mm_;
  double steepness_;  // most that height() changes over a mm, beyond half of inner_mm_
  double step_;       // least, mm
};

inline constexpr std::array<std::string_view, 6> kBodyNames{
    "ball", "blob_a", "blob_b", "blob_c", "blob_d", "dent"};
/// Bodies that come with the program: "ball"; "blob_a", convex to the front with three bumps; "blob_b", with a saddle and a dent in front; "blob_c" and
/// "blob_d", of lobes drawn at random (blob_of_seed with seeds 3 and 4), by which nothing was chosen; "dent", a ball with one deep dent.
/// Errors: kNotFound for another name.
Result<BlobShape> blob_of_name(std::string_view name, double radius_mm);

/// Six lobes towards directions drawn evenly from the half that faces +z, 0.5 to 1 radian wide, -0.08 to 0.2 of the radius high.
BlobShape blob_of_seed(std::uint64_t seed, double radius_mm);

}  // namespace opaline::sim
