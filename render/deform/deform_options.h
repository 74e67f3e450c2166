#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "base/pose.h"
#include "base/result.h"

namespace opaline::render {

/// One control point of a cage, or a layer of them, moved.
struct CageHandle {
  std::array<int, 3> point{-1, -1, -1};  ///< along x, y, z from 0; -1: all of that axis
  Vec3 move{};                           ///< mm
};

/// A segment that carries what is near it.
struct Bone {
  std::string name = "bone";
  std::string parent{};  ///< the bone that carries this one; empty: none
  Vec3 head{};           ///< at rest, mm
  Vec3 tail{};
  std::array<double, 3> rotation_degrees{};  ///< about the head, x first, then y, then z
  Vec3 move{};                               ///< mm, after the rotation
};

/// How an object is bent; everything in the object's own frame, at rest.
struct DeformOptions {
  enum class Kind : std::uint8_t { kNone, kCage, kBones };
  /// What becomes of a shape whose tetrahedra are turned inside out: an error, or a picture that shows where, lit as it
  /// was before.
  enum class Inverted : std::uint8_t { kRefuse, kMark };
  Kind kind = Kind::kNone;
  Inverted inverted = Inverted::kRefuse;
  double amount = 1.0;  ///< share of every move and angle
  std::array<int, 3> points{
      3, 3, 3};  ///< of the cage, 2 to 8 along each axis of the shape's bounding box
  std::vector<CageHandle> handles;
  std::vector<Bone> bones;
};

/// Errors: kInvalidArgument for a control point that the cage does not have, a bone without length or with a parent that
///         does not come before it, or numbers out of range.
Result<void> validate(const DeformOptions& options);

}  // namespace opaline::render
