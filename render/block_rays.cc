#include "render/block_rays.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "base/thread_team.h"
#include "reconstruct/diffusion/fresnel.h"
#include "render/scene_buffer.h"

namespace opaline::render {
namespace {

using Axes = std::array<double, 3>;

Axes axes_of(Vec3 v) { return {v.x, v.y, v.z}; }

/// Where a ray enters the block.
struct Entered {
  Face face = Face::kZMax;
  Axes place{};
  double cosine = 1.0;
};

/// Four cells around a place on a face, and how much of each.
class Bilinear {
 public:
  Bilinear(const Block& block, const Entered& hit) {
    const int axis = axis_of(hit.face);
    const Axes spacing = block.spacing();
    const int u = axis == 0 ? 1 : 0;
    const int v = axis == 2 ? 1 : 2;
    across_ = Span(hit.place[u] / spacing[u], block.face_width(hit.face));
    down_ = Span(hit.place[v] / spacing[v], block.face_height(hit.face));
  }
  double of(const Image<float>& raster, int channel) const {
    const auto along = [&](int row) {
      return std::lerp(static_cast<double>(raster.at(across_.low, row, channel)),
                       static_cast<double>(raster.at(across_.high, row, channel)),
                       across_.share);
    };
    return std::lerp(along(down_.low), along(down_.high), down_.share);
  }

 private:
  struct Span {
    int low = 0;
    int high = 0;
    double share = 0.0;
    Span() = default;
    Span(double in_cells, int cells) {
      const double at = std::clamp(in_cells - 0.5, 0.0, cells - 1.0);
      low = static_cast<int>(at);
      high = std::min(low + 1, cells - 1);
      share = at - low;
    }
  };
  Span across_;
  Span down_;
};

class BlockRays {
 public:
  BlockRays(const SurfaceField& field, const CameraModel& camera)
      : field_(field), camera_(camera), centre_(axes_of(camera.centre())) {}

  void draw_row(int y, int samples, Image<float>& picture) const {
    for (int x = 0; x < camera_.width; ++x) {
      std::array<double, 4> sum{};
      for (int k = 0; k < samples * samples; ++k) {
        const int column = k % samples;
        const int row = k / samples;
        const double at_x = x + (column + 0.5) / samples;
        const double at_y = y + (row + 0.5) / samples;
        const auto hit = meet(normalized(camera_.ray_direction({at_x, at_y})));
        if (hit) add(*hit, sum);
      }
      for (int c = 0; c < 4; ++c) {
        picture.at(x, y, c) = static_cast<float>(sum[c] / (samples * samples));
      }
    }
  }

 private:
  std::optional<Entered> meet(Vec3 direction) const {
    const Axes way = axes_of(direction);
    const Axes size = axes_of(field_.block.size());
    double enters = 0.0;
    double leaves = std::numeric_limits<double>::infinity();
    int axis = -1;
    for (int a = 0; a < 3; ++a) {
      if (way[a] == 0.0) {
        if (centre_[a] < 0.0 || centre_[a] > size[a]) return std::nullopt;
        continue;
      }
      const double low = -centre_[a] / way[a];
      const double high = (size[a] - centre_[a]) / way[a];
      if (std::min(low, high) > enters) {
        enters = std::min(low, high);
        axis = a;
      }
      leaves = std::min(leaves, std::max(low, high));
    }
    if (axis < 0 || enters > leaves) return std::nullopt;
    Entered hit{kFaces[2 * axis + (way[axis] < 0.0 ? 1 : 0)], {}, std::abs(way[axis])};
    for (int a = 0; a < 3; ++a) hit.place[a] = centre_[a] + enters * way[a];
    return hit;
  }

  void add(const Entered& hit, std::array<double, 4>& sum) const {
    namespace diffusion = reconstruct::diffusion;
    const double ior = field_.ior;
    const double passed = 1.0 - diffusion::fresnel_reflectance(std::min(1.0, hit.cosine), ior);
    const double inside = diffusion::refracted_cosine(hit.cosine, ior);
    const FaceField& face = field_.faces[static_cast<std::size_t>(hit.face)];
    const Bilinear at(field_.block, hit);
    for (int c = 0; c < 3; ++c) {
      const double light = at.of(face.fluence, c) + 3.0 * inside * at.of(face.net_flux, c);
      sum[c] += passed / (4.0 * std::numbers::pi * ior * ior) * light;
      if (!face.reflected.empty()) sum[c] += at.of(face.reflected, c);
    }
    sum[3] += 1.0;
  }

  const SurfaceField& field_;
  const CameraModel& camera_;
  Axes centre_;
};

}  // namespace

Result<Image<float>> draw_by_rays(const SurfaceField& field,
                                  const CameraModel& camera,
                                  int samples_per_axis,
                                  int threads,
                                  std::stop_token stop) {
  if (auto good = validate(field); !good) return good.error();
  if (const auto scene = describe_scene(field, camera, samples_per_axis); !scene) {
    return scene.error();
  }
  const BlockRays rays(field, camera);
  Image<float> picture(camera.width, camera.height, 4);
  std::atomic<int> next{0};
  ThreadTeam team(threads);
  team.run([&](int) {
    for (int y = next++; y < camera.height && !stop.stop_requested(); y = next++) {
      rays.draw_row(y, samples_per_axis, picture);
    }
  });
  if (stop.stop_requested()) return cancelled("drawing was stopped");
  return picture;
}

}  // namespace opaline::render
