#pragma once

#include <cmath>
#include <numbers>

#include "render/mesh/triangle_mesh.h"

namespace opaline::render {

/// A cube with corners at 0 and `edge`, shifted; 12 triangles.
inline TriangleMesh cube_mesh(double edge, Vec3 shift = {}) {
  TriangleMesh mesh;
  for (int i = 0; i < 8; ++i) {
    mesh.vertices.push_back(shift + Vec3{static_cast<double>(i & 1),
                                         static_cast<double>(i >> 1 & 1),
                                         static_cast<double>(i >> 2)} *
                                        edge);
  }
  mesh.triangles = {{0, 2, 3},
                    {0, 3, 1},
                    {4, 5, 7},
                    {4, 7, 6},
                    {0, 1, 5},
                    {0, 5, 4},
                    {2, 6, 7},
                    {2, 7, 3},
                    {0, 4, 6},
                    {0, 6, 2},
                    {1, 3, 7},
                    {1, 7, 5}};
  return mesh;
}

/// A sphere around the origin of 2 n (n - 1) triangles times 2, closed at the poles.
inline TriangleMesh sphere_mesh(double radius, int n) {
  TriangleMesh mesh;
  mesh.vertices.push_back({0.0, 0.0, radius});
  for (int ring = 1; ring < n; ++ring) {
    for (int k = 0; k < 2 * n; ++k) {
      const double theta = std::numbers::pi * ring / n;
      const double phi = std::numbers::pi * k / n;
      mesh.vertices.push_back(
          Vec3{std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)} *
          radius);
    }
  }
  mesh.vertices.push_back({0.0, 0.0, -radius});
  const auto at = [n](int ring, int k) { return 1 + (ring - 1) * 2 * n + k % (2 * n); };
  const auto last = static_cast<int>(mesh.vertices.size()) - 1;
  for (int k = 0; k < 2 * n; ++k) {
    mesh.triangles.push_back({0, at(1, k), at(1, k + 1)});
    mesh.triangles.push_back({last, at(n - 1, k + 1), at(n - 1, k)});
    for (int ring = 1; ring + 1 < n; ++ring) {
      mesh.triangles.push_back({at(ring, k), at(ring + 1, k), at(ring + 1, k + 1)});
      mesh.triangles.push_back({at(ring, k), at(ring + 1, k + 1), at(ring, k + 1)});
    }
  }
  return mesh;
}

inline void append(TriangleMesh& mesh, const TriangleMesh& other) {
  const auto base = static_cast<int>(mesh.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), other.vertices.begin(), other.vertices.end());
  for (const auto& t : other.triangles)
    mesh.triangles.push_back({t[0] + base, t[1] + base, t[2] + base});
}

}  // namespace opaline::render
