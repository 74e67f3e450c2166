#include "render/scene/shell_material.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "render/tetrahedra/stuffing.h"

namespace opaline::render {
namespace {

constexpr int kFootSteps = 3;
constexpr double kShellStep = 1e-3;   // of the shell's depth, for gradients
constexpr double kLeastShare = 1e-3;  // of the three projections
constexpr double kCoreTets = 4000.0;  // what the core's surface is sampled by

/// What is deeper in a solid than `depth`.
class InnerSolid final : public SignedDistance {
 public:
  InnerSolid(const SignedDistance& solid, double depth) : solid_(solid), depth_(depth) {}
  double at(Vec3 p) const override { return solid_.at(p) + depth_; }
  Box bounds() const override { return solid_.bounds(); }

 private:
  const SignedDistance& solid_;
  double depth_;
};

}  // namespace

Result<ShellMaterial> ShellMaterial::create(std::shared_ptr<const Material> block,
                                            const ShellOptions& options,
                                            const SignedDistance& solid,
                                            const Pose& scene_from_shape,
                                            std::stop_token stop) {
  if (!(options.scale > 0.0) || !(options.depth_mm >= 0.0)) {
    return invalid_argument(fmt::format("a shell of depth {} mm, scale {}; expected >= 0 and > 0",
                                        options.depth_mm,
                                        options.scale));
  }
  ShellMaterial shell(std::move(block), options, solid, scene_from_shape);
  if (options.depth_mm == 0.0) {
    shell.options_.depth_mm = shell.block_->block.size().z * options.scale;
  }
  if (auto sampled = shell.sample_core(std::move(stop)); !sampled) return sampled.error();
  return shell;
}

Result<void> ShellMaterial::sample_core(std::stop_token stop) {
  const InnerSolid core(*solid_, options_.depth_mm);
  const double volume = estimate_volume(core);
  if (!(volume > 0.0)) return ok();
  blend_mm_ = spacing_for(volume, kCoreTets);
  const auto tets = stuff(core, {.spacing_mm = blend_mm_, .interior_growth = 1.0}, stop);
  if (stop.stop_requested()) return cancelled("looking for the core of a shell");
  if (!tets) return ok();  // nothing of it is as thick as the lattice is fine
  const TriangleMesh surface = surface_mesh(*tets);
  for (const auto& t : surface.triangles) {
    const Vec3 a = surface.vertices[t[0]];
    const Vec3 b = surface.vertices[t[1]];
    const Vec3 c = surface.vertices[t[2]];
    const Vec3 middle = (a + b + c) * (1.0 / 3.0);
    samples_.push_back({middle, cross(b - a, c - a) * 0.5, in_shell(middle, options_.depth_mm)});
  }
  return ok();
}

Coefficients ShellMaterial::in_shell(Vec3 place, double depth) const {
  const double step = kShellStep * options_.depth_mm;
  Vec3 foot = place;
  Vec3 normal;
  for (int k = 0; k < kFootSteps; ++k) {
    normal = solid_->normal(foot, step);
    foot = foot - normal * solid_->at(foot);
  }
  const Vec3 n = shape_from_scene_.rotate(normal);
  const Vec3 s = (shape_from_scene_.apply(foot) - options_.origin) * (1.0 / options_.scale);
  const double z = block_->block.size().z - depth / options_.scale;
  const std::array<double, 3> weights = view_weights(n);
  const std::array<Vec3, 3> places{Vec3{s.y, s.z, z}, {s.z, s.x, z}, {s.x, s.y, z}};
  const double all = weights[0] + weights[1] + weights[2];
  const std::array<Tiling, 3> tiling{options_.tiling, options_.tiling, Tiling::kClamp};
  if (!(all > 0.0)) return looked_up(*block_, places[2], tiling);
  Coefficients sum;
  double used = 0.0;
  for (int k = 0; k < 3; ++k) {
    if (weights[k] < kLeastShare * all) continue;
    sum += looked_up(*block_, places[k], tiling) * weights[k];
    used += weights[k];
  }
  return sum * (1.0 / used);
}

Coefficients ShellMaterial::in_core(Vec3 place) const {
  Coefficients sum;
  double weights = 0.0;
  for (const Sample& sample : samples_) {
    const Vec3 way = sample.place - place;
    const double square = std::max(dot(way, way), 1e-12 * blend_mm_ * blend_mm_);
    const double weight = std::abs(dot(sample.area, way)) / (square * square);
    sum += sample.value * weight;
    weights += weight;
  }
  return sum * (1.0 / weights);
}

Coefficients ShellMaterial::at(Vec3 place) const {
  const double depth = std::max(0.0, -solid_->at(place));
  if (samples_.empty() || depth <= options_.depth_mm) return in_shell(place, depth);
  const double share = (depth - options_.depth_mm) / blend_mm_;
  if (share >= 1.0) return in_core(place);
  Coefficients mixed = in_shell(place, options_.depth_mm) * (1.0 - share);
  mixed += in_core(place) * share;
  return mixed;
}

}  // namespace opaline::render
