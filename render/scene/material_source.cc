#include "render/scene/material_source.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/io/volume_io.h"
#include "render/scene/noise.h"

namespace opaline::render {
namespace {

constexpr int kOctaves = 3;
constexpr double kSharpness = 4.0;

Optics optics_of(const Colour& absorption, const Colour& scattering) {
  Optics optics;
  optics.absorption = absorption;
  for (int c = 0; c < 3; ++c) optics.diffusion[c] = 1.0 / (3.0 * (absorption[c] + scattering[c]));
  return optics;
}

Result<void> check_scatters(const Material& material) {
  for (int c = 0; c < kColorChannels; ++c) {
    const auto& channel = material.channels[c];
    for (std::size_t i = 0; i < channel.absorption.size(); ++i) {
      if (channel.absorption[i] + channel.reduced_scattering[i] > 0.0) continue;
      return invalid_argument(fmt::format(
          "cell {} neither scatters nor absorbs {}: no light diffuses there", i, kChannelNames[c]));
    }
  }
  return ok();
}

}  // namespace

Result<MaterialSource> MaterialSource::create(const TranslucentOptions& options,
                                              const Pose& scene_from_shape) {
  MaterialSource source(options, scene_from_shape);
  if (options.file.empty()) return source;
  auto material = read_material(options.file);
  if (!material) return material.error();
  if (auto scatters = check_scatters(*material); !scatters) {
    return scatters.error().in(options.file.string());
  }
  source.ior_ = material->ior;
  source.block_ = std::make_shared<Material>(*std::move(material));
  return source;
}

void MaterialSource::take_block(std::shared_ptr<Material> block, Vec3 origin) {
  block_ = std::move(block);
  options_.origin = origin;
  options_.scale = 1.0;
  options_.tiling = Tiling::kClamp;
  shell_.reset();
}

Result<void> MaterialSource::wrap(const SignedDistance& solid, std::stop_token stop) {
  if (!block_ || options_.placement != Placement::kShell) return ok();
  auto shell = ShellMaterial::create(block_,
                                     {.depth_mm = options_.shell_depth_mm,
                                      .scale = options_.scale,
                                      .origin = options_.origin,
                                      .tiling = options_.tiling},
                                     solid,
                                     shape_from_scene_.inverse(),
                                     std::move(stop));
  if (!shell) return shell.error();
  shell_ = *std::move(shell);
  return ok();
}

bool MaterialSource::is_homogeneous() const {
  const PatternOptions& pattern = options_.pattern;
  return !block_ && (pattern.kind == PatternOptions::Kind::kNone ||
                     (pattern.absorption == options_.absorption &&
                      pattern.reduced_scattering == options_.reduced_scattering));
}

double MaterialSource::pattern_weight(Vec3 place) const {
  const Vec3 p = place * (1.0 / options_.pattern.size_mm);
  if (options_.pattern.kind == PatternOptions::Kind::kLayers) {
    return p.z - 2.0 * std::floor(0.5 * p.z) < 1.0 ? 1.0 : 0.0;
  }
  const double wave =
      std::sin(std::numbers::pi * (p.x + 0.5 * p.y + 1.6 * fractal_noise(p, kOctaves)));
  return std::pow(1.0 - std::abs(wave), kSharpness);
}

Optics MaterialSource::at(Vec3 place_in_scene) const {
  if (shell_) {
    const Coefficients found = shell_->at(place_in_scene);
    return optics_of(found.absorption, found.reduced_scattering);
  }
  const Vec3 place = shape_from_scene_.apply(place_in_scene);
  if (block_) return in_block(place);
  if (is_homogeneous()) return optics_of(options_.absorption, options_.reduced_scattering);
  const double w = pattern_weight(place);
  const auto mixed = [w](const Colour& a, const Colour& b) {
    Colour colour{};
    for (int c = 0; c < 3; ++c) colour[c] = std::pow(a[c], 1.0 - w) * std::pow(b[c], w);
    return colour;
  };
  return optics_of(mixed(options_.absorption, options_.pattern.absorption),
                   mixed(options_.reduced_scattering, options_.pattern.reduced_scattering));
}

Optics MaterialSource::in_block(Vec3 place) const {
  const Tiling tiling = options_.tiling;
  const Vec3 p = (place - options_.origin) * (1.0 / options_.scale);
  const Coefficients found = looked_up(*block_, p, {tiling, tiling, tiling});
  return optics_of(found.absorption, found.reduced_scattering);
}

}  // namespace opaline::render
