#pragma once

#include <cstdint>
#include <string>

#include "base/block.h"
#include "base/material.h"
#include "base/result.h"

namespace opaline::sim {

enum class SceneKind : std::uint8_t {
  kHomogeneous,  ///< the same everywhere
  kLayered,      ///< two layers along z, their boundary slightly wavy
  kWax,          ///< smooth blobs, some millimetres wide
  kMarble,       ///< thin curved veins, dark and little scattering, in a bright ground
  kStone         ///< grains with a coefficient each, and dark seams between them
};

/// A procedural sample. Every voxel's truth follows from these values alone.
struct SceneOptions {
  SceneKind kind = SceneKind::kMarble;
  std::uint64_t seed = 1;
  Block block{48, 48, 12, 0.5, 0.5, 0.5};
  double ior = 1.3;                 ///< 1 to 3
  double reduced_scattering = 1.6;  ///< of the ground in green, 1/mm; > 0
  double absorption = 0.004;        ///< of the ground in green, 1/mm; >= 0
  double contrast = 1.0;            ///< 0: homogeneous, 1: as the kind has it; 0 to 2
  double feature_mm = 6.0;          ///< size of blobs, grains, distance of veins; > 0
  bool operator==(const SceneOptions&) const = default;
};

Result<void> validate(const SceneOptions& options);

/// The sample itself. Values are for voxel centres; all coefficients are finite, scattering is
/// positive.
Result<Material> make_material(const SceneOptions& options);

/// "marble" and so on.
std::string_view to_string(SceneKind kind);
Result<SceneKind> scene_kind(std::string_view name);

/// One line of JSON with every option, and back; an unknown or missing key is kInvalidArgument.
std::string to_json(const SceneOptions& options);
Result<SceneOptions> scene_from_json(std::string_view text);

}  // namespace opaline::sim
