#pragma once

#include <array>
#include <cstdint>
#include <filesystem>

#include "base/pose.h"
#include "base/result.h"

namespace opaline::render {

/// One stroke in a material: what is done to which coefficient, and where. Places are in the object's own frame at rest, mm.
///
///   paint   c + w (value - c)          w: strength x brush x mask, 0 to 1
///   scale   c value^w
///   add     c + w value                never below 0, of scattering never below 1e-6
///   set     value where w >= 1/2
///
/// The brush is 1 within radius (1 - softness) of the centre and falls to 0 at the radius as a smoothstep. Its reach:
///
///   ball      the distance from the centre
///   depth     the distance from the axis through the centre along `direction`, where the signed distance says that the
///             surface is `depth` away, give or take half the thickness, with the same softness
///   through   the distance from the axis alone: all that lies along it
struct EditOptions {
  enum class Operation : std::uint8_t { kPaint, kScale, kAdd, kSet };
  enum class Quantity : std::uint8_t { kAbsorption, kReducedScattering };
  enum class Reach : std::uint8_t { kBall, kDepth, kThrough };
  Operation operation = Operation::kPaint;
  Quantity quantity = Quantity::kAbsorption;
  std::array<double, 3> value{0.1, 0.1, 0.1};  ///< red, green, blue; 1/mm, or factors of scale
  double strength = 1.0;                       ///< 0 to 1
  Reach reach = Reach::kBall;
  Vec3 centre{};
  Vec3 direction{0.0, 0.0, 1.0};  ///< of the axis, and in which a mask is projected; any length > 0
  double radius_mm = 3.0;         ///< > 0
  double softness = 0.5;          ///< 0 to 1
  double depth_mm = 1.0;          ///< >= 0
  double thickness_mm = 1.0;      ///< > 0
  std::filesystem::path mask{};   ///< picture across the brush, 0 to 1; empty: none
};

/// Errors: kInvalidArgument, naming the key.
Result<void> validate(const EditOptions& edit);

}  // namespace opaline::render
