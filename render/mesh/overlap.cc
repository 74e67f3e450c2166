#include "render/mesh/overlap.h"

#include <algorithm>
#include <cmath>

namespace opaline::render {
namespace {

constexpr std::size_t kPlaces = 8'000;
constexpr double kAside = 1e-3;  // of the square root of a triangle's area
// Roberts' sequence in two dimensions: 1/p and 1/p^2 of the root of p^3 = p + 1.
constexpr double kAlongU = 0.7548776662466927;
constexpr double kAlongV = 0.5698402909980532;

Vec3 place_in(Vec3 a, Vec3 b, Vec3 c, std::size_t number) {
  const auto n = static_cast<double>(number);
  double u = std::fmod(0.5 + n * kAlongU, 1.0);
  double v = std::fmod(0.5 + n * kAlongV, 1.0);
  if (u + v > 1.0) {
    u = 1.0 - u;
    v = 1.0 - v;
  }
  return a + (b - a) * u + (c - a) * v;
}

}  // namespace

double buried_share(const TriangleMesh& mesh,
                    const MeshDistance& distance,
                    const std::stop_token& stop) {
  const std::size_t triangles = mesh.triangles.size();
  const std::size_t step = std::max<std::size_t>(1, triangles / kPlaces);
  const std::size_t places =
      std::max<std::size_t>(1, kPlaces / std::max<std::size_t>(1, triangles));
  double buried = 0.0;
  double all = 0.0;
  for (std::size_t t = 0; t < triangles; t += step) {
    if (stop.stop_requested()) return 0.0;
    const auto& [i, j, k] = mesh.triangles[t];
    const Vec3 a = mesh.vertices[i];
    const Vec3 b = mesh.vertices[j];
    const Vec3 c = mesh.vertices[k];
    const Vec3 n = cross(b - a, c - a);
    const double twice_area = length(n);
    if (!(twice_area > 0.0)) continue;
    const Vec3 aside = n * (kAside * std::sqrt(0.5 * twice_area) / twice_area);
    for (std::size_t p = 0; p < places; ++p) {
      const Vec3 place = place_in(a, b, c, t + p);
      const double share = twice_area / static_cast<double>(places);
      all += share;
      if (distance.winding(place + aside) > 0.5 && distance.winding(place - aside) > 0.5) {
        buried += share;
      }
    }
  }
  return all > 0.0 ? buried / all : 0.0;
}

}  // namespace opaline::render
