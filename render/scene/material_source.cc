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

/// The two cells around a coordinate in cells, and the share of the second.
struct Span {
  int low = 0;
  int high = 0;
  double share = 0.0;
};

Span span_at(double coordinate, int cells, Tiling tiling) {
  const double place = tiled(coordinate, cells, tiling);
  const int low = static_cast<int>(std::floor(place));
  const double share = place - low;
  if (tiling == Tiling::kRepeat) return {(low + cells) % cells, (low + 1 + cells) % cells, share};
  return {std::clamp(low, 0, cells - 1), std::clamp(low + 1, 0, cells - 1), share};
}

}  // namespace

double tiled(double coordinate, int cells, Tiling tiling) {
  switch (tiling) {
    case Tiling::kClamp:
      return std::clamp(coordinate, 0.0, cells - 1.0);
    case Tiling::kRepeat:
      return coordinate - cells * std::floor((coordinate + 0.5) / cells);
    case Tiling::kMirror:
      break;
  }
  const double turn =
      coordinate + 0.5 - 2.0 * cells * std::floor((coordinate + 0.5) / (2.0 * cells));
  return (turn < cells ? turn : 2.0 * cells - turn) - 0.5;
}

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
  const Block& block = block_->block;
  const Vec3 p = (place - options_.origin) * (1.0 / options_.scale);
  const std::array spans{span_at(p.x / block.hx - 0.5, block.nx, options_.tiling),
                         span_at(p.y / block.hy - 0.5, block.ny, options_.tiling),
                         span_at(p.z / block.hz - 0.5, block.nz, options_.tiling)};
  Colour absorption{};
  Colour scattering{};
  for (int corner = 0; corner < 8; ++corner) {
    std::array<int, 3> cell{};
    double weight = 1.0;
    for (int axis = 0; axis < 3; ++axis) {
      const bool second = (corner >> axis & 1) != 0;
      cell[axis] = second ? spans[axis].high : spans[axis].low;
      weight *= second ? spans[axis].share : 1.0 - spans[axis].share;
    }
    const std::size_t index = block.index(cell[0], cell[1], cell[2]);
    for (int c = 0; c < 3; ++c) {
      absorption[c] += weight * block_->channels[c].absorption[index];
      scattering[c] += weight * block_->channels[c].reduced_scattering[index];
    }
  }
  return optics_of(absorption, scattering);
}

}  // namespace opaline::render
