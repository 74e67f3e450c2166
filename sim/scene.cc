#include "sim/scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "sim/noise.h"

namespace opaline::sim {
namespace {

constexpr std::array<std::string_view, 5> kKindNames{
    "homogeneous", "layered", "wax", "marble", "stone"};

// Red, green, blue against green: white stone scatters blue a little more and absorbs it more.
constexpr std::array<double, kColorChannels> kScatteringTint{0.92, 1.0, 1.08};
constexpr std::array<double, kColorChannels> kAbsorptionTint{0.6, 1.0, 1.8};

/// Logarithms of what multiplies the ground's scattering and absorption at one place.
struct Change {
  double scattering = 0.0;
  std::array<double, kColorChannels> absorption{};
};

Change grey(double scattering, double absorption) {
  return {scattering, {absorption, absorption, absorption}};
}

double smooth_step(double from, double to, double x) {
  const double t = std::clamp((x - from) / (to - from), 0.0, 1.0);
  return t * t * (3.0 - 2.0 * t);
}

Change layered(const SceneOptions& options, Vec3 p) {
  const Vec3 at{p.x / options.feature_mm, p.y / options.feature_mm, 0.5};
  const double thickness = options.block.size().z;
  const double boundary = thickness * (0.5 + 0.08 * gradient_noise(at, options.seed));
  return p.z < boundary ? grey(0.3, -0.4) : grey(-0.4, 0.8);
}

Change wax(const SceneOptions& options, Vec3 p) {
  const Vec3 at = p * (1.0 / options.feature_mm);
  const double dense = fractal_noise(at, options.seed, 2);
  const double dark = fractal_noise(at, options.seed + 100, 2);
  const double warm = fractal_noise(at, options.seed + 200, 2);
  return {0.9 * dense, {1.6 * dark - 0.5 * warm, 1.6 * dark, 1.6 * dark + 0.8 * warm}};
}

Change marble(const SceneOptions& options, Vec3 p) {
  const Vec3 at = p * (1.0 / options.feature_mm);
  // Layers across a slanted direction, folded by noise; a vein is where two layers meet.
  const double fold = fractal_noise(at * 0.6, options.seed, 2);
  const double across = (0.6 * at.x + 0.45 * at.y + 0.35 * at.z) + 1.5 * fold;
  const double strength = 0.7 + 0.6 * gradient_noise(at * 0.5, options.seed + 100);
  const double ridge = 1.0 - std::abs(std::sin(std::numbers::pi * across));
  const double vein = strength * smooth_step(0.25, 1.0, ridge);
  const double cloud = fractal_noise(at * 1.4, options.seed + 200, 3);
  const double dark = 1.7 * vein + 0.5 * cloud;
  return {0.25 * cloud - 0.75 * vein, {dark + 0.25 * vein, dark, dark - 0.35 * vein}};
}

Change stone(const SceneOptions& options, Vec3 p) {
  const CellNoise grain = cell_noise(p * (1.5 / options.feature_mm), options.seed);
  const double seam = 1.0 - smooth_step(0.03, 0.15, grain.second - grain.nearest);
  const double dark = 2.0 * (grain.value - 0.5);
  const double dense = std::fmod(grain.value * 7.0, 1.0) - 0.5;
  return grey(0.9 * dense - 0.3 * seam, 0.8 * dark + 1.2 * seam);
}

Change change_at(const SceneOptions& options, Vec3 p) {
  switch (options.kind) {
    case SceneKind::kHomogeneous:
      return {};
    case SceneKind::kLayered:
      return layered(options, p);
    case SceneKind::kWax:
      return wax(options, p);
    case SceneKind::kMarble:
      return marble(options, p);
    case SceneKind::kStone:
      return stone(options, p);
  }
  return {};
}

Result<void> within(const char* name, double value, double least, double most) {
  if (value >= least && value <= most) return ok();
  return invalid_argument(
      fmt::format("scene: {} = {}; expected {} to {}", name, value, least, most));
}

}  // namespace

Result<void> validate(const SceneOptions& options) {
  for (const int count : options.block.cells()) {
    if (auto valid = within("cells", count, 1, 1024); !valid) return valid;
  }
  for (const double spacing : options.block.spacing()) {
    if (auto valid = within("spacing_mm", spacing, 1e-3, 100.0); !valid) return valid;
  }
  if (auto valid = within("ior", options.ior, 1.0, 3.0); !valid) return valid;
  if (auto valid = within("reduced_scattering", options.reduced_scattering, 1e-3, 1e3); !valid) {
    return valid;
  }
  if (auto valid = within("absorption", options.absorption, 0.0, 1e2); !valid) return valid;
  if (auto valid = within("contrast", options.contrast, 0.0, 2.0); !valid) return valid;
  return within("feature_mm", options.feature_mm, 1e-2, 1e4);
}

Result<Material> make_material(const SceneOptions& options) {
  if (auto valid = validate(options); !valid) return valid.error();
  const Block& block = options.block;
  Material material{block, options.ior, {}, std::string(to_string(options.kind))};
  for (ChannelCoefficients& channel : material.channels) {
    channel.absorption.resize(block.cell_count());
    channel.reduced_scattering.resize(block.cell_count());
  }
  for (int k = 0; k < block.nz; ++k) {
    for (int j = 0; j < block.ny; ++j) {
      for (int i = 0; i < block.nx; ++i) {
        const Vec3 centre{(i + 0.5) * block.hx, (j + 0.5) * block.hy, (k + 0.5) * block.hz};
        const Change change = change_at(options, centre);
        const std::size_t cell = block.index(i, j, k);
        for (int c = 0; c < kColorChannels; ++c) {
          material.channels[c].reduced_scattering[cell] =
              options.reduced_scattering * kScatteringTint[c] *
              std::exp(options.contrast * change.scattering);
          material.channels[c].absorption[cell] = options.absorption * kAbsorptionTint[c] *
                                                  std::exp(options.contrast * change.absorption[c]);
        }
      }
    }
  }
  return material;
}

std::string_view to_string(SceneKind kind) { return kKindNames[static_cast<std::size_t>(kind)]; }

Result<SceneKind> scene_kind(std::string_view name) {
  for (std::size_t i = 0; i < kKindNames.size(); ++i) {
    if (name == kKindNames[i]) return static_cast<SceneKind>(i);
  }
  return invalid_argument(
      fmt::format("scene kind \"{}\"; expected {}", name, fmt::join(kKindNames, ", ")));
}

std::string to_json(const SceneOptions& options) {
  const nlohmann::ordered_json json{{"kind", to_string(options.kind)},
                                    {"seed", options.seed},
                                    {"cells", options.block.cells()},
                                    {"spacing_mm", options.block.spacing()},
                                    {"ior", options.ior},
                                    {"reduced_scattering", options.reduced_scattering},
                                    {"absorption", options.absorption},
                                    {"contrast", options.contrast},
                                    {"feature_mm", options.feature_mm}};
  return json.dump();
}

Result<SceneOptions> scene_from_json(std::string_view text) {
  try {
    const nlohmann::json json = nlohmann::json::parse(text);
    auto kind = scene_kind(json.at("kind").get<std::string>());
    if (!kind) return kind.error();
    const auto cells = json.at("cells").get<std::array<int, 3>>();
    const auto spacing = json.at("spacing_mm").get<std::array<double, 3>>();
    SceneOptions options;
    options.kind = *kind;
    options.seed = json.at("seed").get<std::uint64_t>();
    options.block = {cells[0], cells[1], cells[2], spacing[0], spacing[1], spacing[2]};
    options.ior = json.at("ior").get<double>();
    options.reduced_scattering = json.at("reduced_scattering").get<double>();
    options.absorption = json.at("absorption").get<double>();
    options.contrast = json.at("contrast").get<double>();
    options.feature_mm = json.at("feature_mm").get<double>();
    if (json.size() != 9) return invalid_argument("scene: unknown key in its description");
    if (auto valid = validate(options); !valid) return valid.error();
    return options;
  } catch (const nlohmann::json::exception& error) {
    return invalid_argument(fmt::format("scene: {}", error.what()));
  }
}

}  // namespace opaline::sim
