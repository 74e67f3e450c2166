#include "render/dipole/mesh_texels.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace opaline::render {
namespace {

constexpr double kSteepestSeen = 0.2;  // cosine below which a pixel's area is not believed

/// A place in a raster, and how near it is.
struct RasterPoint {
  double x = 0.0;
  double y = 0.0;
  double near = 0.0;
};

double signed_area(const RasterPoint& a, const RasterPoint& b, const RasterPoint& c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

/// Calls f(x, y, weights) for the raster's cells whose middle lies in a triangle.
template <typename F>
void for_each_cell(const std::array<RasterPoint, 3>& p, int width, int height, const F& f) {
  const double whole = signed_area(p[0], p[1], p[2]);
  if (whole == 0.0) return;
  const auto [left, right] = std::minmax({p[0].x, p[1].x, p[2].x});
  const auto [top, bottom] = std::minmax({p[0].y, p[1].y, p[2].y});
  const int first_x = std::max(0, static_cast<int>(std::ceil(left - 0.5)));
  const int last_x = std::min(width - 1, static_cast<int>(std::floor(right - 0.5)));
  const int first_y = std::max(0, static_cast<int>(std::ceil(top - 0.5)));
  const int last_y = std::min(height - 1, static_cast<int>(std::floor(bottom - 0.5)));
  for (int y = first_y; y <= last_y; ++y)
    for (int x = first_x; x <= last_x; ++x) {
      const RasterPoint at{x + 0.5, y + 0.5};
      const std::array<double, 3> w{signed_area(p[1], p[2], at) / whole,
                                    signed_area(p[2], p[0], at) / whole,
                                    signed_area(p[0], p[1], at) / whole};
      if (w[0] >= 0.0 && w[1] >= 0.0 && w[2] >= 0.0) f(x, y, w);
    }
}

bool fits(const TexturedMesh& mesh, const DipoleTexture& texture) {
  const auto count = static_cast<std::size_t>(std::max(0, texture.width)) *
                     static_cast<std::size_t>(std::max(0, texture.height));
  return count > 0 && texture.reduced_albedo.size() == count && texture.diffusion.size() == count &&
         std::ranges::all_of(mesh.triangles, [&](const auto& triangle) {
           return std::ranges::all_of(triangle, [&](auto n) { return n < mesh.corners.size(); });
         });
}

TexelSurface empty_surface(int width, int height, double texel_mm) {
  const auto count = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  TexelSurface s{.width = width, .height = height, .texel_mm = texel_mm};
  s.position.resize(count);
  s.normal.resize(count);
  s.area.assign(count, 0.0F);
  s.covered.assign(count, 0);
  s.reduced_albedo.assign(count, 0.0F);
  s.diffusion.assign(count, 0.0F);
  return s;
}

using Corners = std::array<const TexturedMesh::Corner*, 3>;
using Weights = std::array<double, 3>;

template <typename Value>
auto mixed(const Corners& corners, const Weights& w, Value value) {
  return value(*corners[0]) * w[0] + value(*corners[1]) * w[1] + value(*corners[2]) * w[2];
}

/// Position, normal and maps of one cell.
void put_cell(const Corners& corners,
              const Weights& w,
              const DipoleTexture& texture,
              const Pose& pose,
              std::size_t at,
              TexelSurface& s) {
  using Corner = TexturedMesh::Corner;
  s.position[at] = pose.apply(mixed(corners, w, [](const Corner& c) { return c.position; }));
  s.normal[at] =
      normalized(pose.rotate(mixed(corners, w, [](const Corner& c) { return c.normal; })));
  const double u = mixed(corners, w, [](const Corner& c) { return c.u; });
  const double v = mixed(corners, w, [](const Corner& c) { return c.v; });
  const int x = std::clamp(static_cast<int>(u * texture.width), 0, texture.width - 1);
  const int y = std::clamp(static_cast<int>((1.0 - v) * texture.height), 0, texture.height - 1);
  const auto from = static_cast<std::size_t>(y) * static_cast<std::size_t>(texture.width) +
                    static_cast<std::size_t>(x);
  s.reduced_albedo[at] = texture.reduced_albedo[from];
  s.diffusion[at] = texture.diffusion[from];
  s.covered[at] = s.diffusion[at] > 0.0F ? 1 : 0;
}

Corners corners_of(const TexturedMesh& mesh, const std::array<std::uint32_t, 3>& triangle) {
  return {&mesh.corners[triangle[0]], &mesh.corners[triangle[1]], &mesh.corners[triangle[2]]};
}

std::size_t cell_index(int x, int y, int width) {
  return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
         static_cast<std::size_t>(x);
}

}  // namespace

Result<TexelSurface> texels_of_texture(const TexturedMesh& mesh,
                                       const DipoleTexture& texture,
                                       int width,
                                       int height) {
  if (!fits(mesh, texture) || width < 1 || height < 1)
    return invalid_argument("texture-space diffusion: corners or maps that are not there");
  TexelSurface s = empty_surface(width, height, 1.0);
  double surface = 0.0;
  double cells = 0.0;
  for (const auto& triangle : mesh.triangles) {
    const Corners corners = corners_of(mesh, triangle);
    std::array<RasterPoint, 3> p;
    for (std::size_t k = 0; k < 3; ++k)
      p[k] = {corners[k]->u * width, (1.0 - corners[k]->v) * height, 0.0};
    const double area = 0.5 * length(cross(corners[1]->position - corners[0]->position,
                                           corners[2]->position - corners[0]->position));
    const double in_raster = 0.5 * std::abs(signed_area(p[0], p[1], p[2]));
    if (!(area > 0.0 && in_raster > 0.0)) continue;
    surface += area;
    cells += in_raster;
    for_each_cell(p, width, height, [&](int x, int y, const Weights& w) {
      const std::size_t at = cell_index(x, y, width);
      put_cell(corners, w, texture, {}, at, s);
      s.area[at] = static_cast<float>(area / in_raster);
    });
  }
  if (!(cells > 0.0))
    return invalid_argument("texture-space diffusion: no triangle has an area in the texture");
  s.texel_mm = std::sqrt(surface / cells);
  return s;
}

Result<TexelSurface> texels_of_view(const TexturedMesh& mesh,
                                    const DipoleTexture& texture,
                                    const ParallelView& view) {
  if (!fits(mesh, texture) || view.width < 1 || view.height < 1 || !(view.pixel_mm > 0.0))
    return invalid_argument("screen-space diffusion: corners, maps or pixels that are not there");
  TexelSurface s = empty_surface(view.width, view.height, view.pixel_mm);
  std::vector<double> nearest(s.covered.size(), -std::numeric_limits<double>::infinity());
  for (const auto& triangle : mesh.triangles) {
    const Corners corners = corners_of(mesh, triangle);
    std::array<RasterPoint, 3> p;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3 at = view.view_from_mesh.apply(corners[k]->position);
      p[k] = {
          at.x / view.pixel_mm + 0.5 * view.width, 0.5 * view.height - at.y / view.pixel_mm, at.z};
    }
    for_each_cell(p, view.width, view.height, [&](int x, int y, const Weights& w) {
      const std::size_t at = cell_index(x, y, view.width);
      const double near = w[0] * p[0].near + w[1] * p[1].near + w[2] * p[2].near;
      if (near <= nearest[at]) return;
      nearest[at] = near;
      put_cell(corners, w, texture, view.view_from_mesh, at, s);
      s.area[at] = static_cast<float>(view.pixel_mm * view.pixel_mm /
                                      std::max(kSteepestSeen, s.normal[at].z));
    });
  }
  return s;
}

}  // namespace opaline::render
