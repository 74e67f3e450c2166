#include "render/scene/lost_parts.h"

#include <algorithm>

#include "render/mesh/mesh_distance.h"

namespace opaline::render {
namespace {

constexpr std::size_t kLookedAt = 20'000;

}  // namespace

double lost_share(const TriangleMesh& shape,
                  const TriangleMesh& cut,
                  double size_mm,
                  const std::stop_token& stop) {
  const auto distance = MeshDistance::create(cut, stop);
  if (!distance) return 0.0;
  const std::size_t step = std::max<std::size_t>(1, shape.triangles.size() / kLookedAt);
  double lost = 0.0;
  double all = 0.0;
  for (std::size_t t = 0; t < shape.triangles.size() && !stop.stop_requested(); t += step) {
    const auto& [i, j, k] = shape.triangles[t];
    const Vec3 a = shape.vertices[i];
    const Vec3 b = shape.vertices[j];
    const Vec3 c = shape.vertices[k];
    const double area = 0.5 * length(cross(b - a, c - a));
    all += area;
    if ((*distance)->at((a + b + c) * (1.0 / 3.0)) > size_mm) lost += area;
  }
  return all > 0.0 ? lost / all : 0.0;
}

}  // namespace opaline::render
