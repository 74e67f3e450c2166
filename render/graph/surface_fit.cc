#include "render/graph/surface_fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

namespace opaline::render {
namespace {

constexpr int kTerms = 6;
constexpr double kFaces = 0.3;      // cosine between a triangle's normal and the vertex's
constexpr double kSingular = 1e-3;  // of a pivot, relative to its diagonal
constexpr double kMostWeight =
    3.0;  // sum of |weights| beyond which values' errors would be amplified

using Terms = std::array<double, kTerms>;
using Moments = std::array<Terms, kTerms>;

struct Middle {
  int triangle = 0;
  double weight = 0.0;
  Terms terms{};
};

/// The first row of the inverse of the leading count x count block, by Cholesky.
std::optional<Terms> first_row_of_inverse(Moments m, int count) {
  for (int j = 0; j < count; ++j) {
    const double diagonal = m[j][j];
    for (int k = 0; k < j; ++k) m[j][j] -= m[j][k] * m[j][k];
    if (!(m[j][j] > kSingular * diagonal)) return std::nullopt;
    m[j][j] = std::sqrt(m[j][j]);
    for (int i = j + 1; i < count; ++i) {
      for (int k = 0; k < j; ++k) m[i][j] -= m[i][k] * m[j][k];
      m[i][j] /= m[j][j];
    }
  }
  Terms x{};
  for (int i = 0; i < count; ++i) {
    double sum = i == 0 ? 1.0 : 0.0;
    for (int k = 0; k < i; ++k) sum -= m[i][k] * x[k];
    x[i] = sum / m[i][i];
  }
  for (int i = count - 1; i >= 0; --i) {
    for (int k = i + 1; k < count; ++k) x[i] -= m[k][i] * x[k];
    x[i] /= m[i][i];
  }
  return x;
}

/// Weights of the middles in the polynomial of `count` terms at the vertex.
std::optional<std::vector<float>> weights_of(const std::vector<Middle>& middles, int count) {
  Moments moments{};
  for (const Middle& m : middles) {
    for (int i = 0; i < count; ++i) {
      for (int j = 0; j < count; ++j) moments[i][j] += m.weight * m.terms[i] * m.terms[j];
    }
  }
  const auto row = first_row_of_inverse(moments, count);
  if (!row) return std::nullopt;
  std::vector<float> weights;
  double all = 0.0;
  for (const Middle& m : middles) {
    double sum = 0.0;
    for (int i = 0; i < count; ++i) sum += (*row)[i] * m.terms[i];
    weights.push_back(static_cast<float>(m.weight * sum));
    all += std::abs(m.weight * sum);
  }
  if (all > kMostWeight) return std::nullopt;
  return weights;
}

class Fit {
 public:
  explicit Fit(const TriangleMesh& surface) : surface_(surface), around_(surface.vertices.size()) {
    for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
      const auto& [i, j, k] = surface.triangles[t];
      const Vec3 a = surface.vertices[i];
      const Vec3 b = surface.vertices[j];
      const Vec3 c = surface.vertices[k];
      areas_.push_back(cross(b - a, c - a) * 0.5);
      middles_.push_back((a + b + c) * (1.0 / 3.0));
      for (const int v : {i, j, k}) around_[v].push_back(static_cast<int>(t));
    }
  }

  void add_row(int vertex, Interpolation<float>& rows) const {
    const std::vector<Middle> middles = middles_around(vertex);
    std::optional<std::vector<float>> weights;
    for (const int count : {6, 3, 1}) {
      if (!weights && std::ssize(middles) >= count) weights = weights_of(middles, count);
    }
    for (std::size_t m = 0; weights && m < middles.size(); ++m) {
      rows.columns.push_back(middles[m].triangle);
      rows.weights.push_back((*weights)[m]);
    }
    rows.starts.push_back(static_cast<int>(rows.columns.size()));
  }

 private:
  std::vector<int> triangles_around(int vertex) const {
    std::vector<int> all;
    for (const int t : around_[vertex]) {
      for (const int v : surface_.triangles[t]) {
        all.insert(all.end(), around_[v].begin(), around_[v].end());
      }
    }
    std::ranges::sort(all);
    all.erase(std::unique(all.begin(), all.end()), all.end());
    return all;
  }

  std::vector<Middle> middles_around(int vertex) const {
    const Vec3 place = surface_.vertices[vertex];
    Vec3 area{};
    double reach = 0.0;
    for (const int t : around_[vertex]) {
      area = area + areas_[t];
      reach += length(middles_[t] - place) / static_cast<double>(around_[vertex].size());
    }
    if (!(length(area) > 0.0)) return {};
    const Vec3 normal = normalized(area);
    const Vec3 u = normalized(std::abs(normal.x) < 0.6 ? cross(normal, {1.0, 0.0, 0.0})
                                                       : cross(normal, {0.0, 1.0, 0.0}));
    const Vec3 w = cross(normal, u);
    std::vector<Middle> found;
    for (const int t : triangles_around(vertex)) {
      const double size = length(areas_[t]);
      if (!(dot(areas_[t], normal) > kFaces * size)) continue;
      const Vec3 way = (middles_[t] - place) * (1.0 / reach);
      const double x = dot(way, u);
      const double y = dot(way, w);
      found.push_back({t, size * std::exp(-dot(way, way)), {1.0, x, y, x * x, x * y, y * y}});
    }
    return found;
  }

  const TriangleMesh& surface_;
  std::vector<std::vector<int>> around_;  // triangles of each vertex
  std::vector<Vec3> areas_;               // of triangles, along their normals
  std::vector<Vec3> middles_;
};

}  // namespace

SurfaceValues interpolated(const Interpolation<float>& rows, const SurfaceValues& values) {
  SurfaceValues sums(rows.rows());
  for (int v = 0; v < rows.rows(); ++v) {
    for (int e = rows.starts[v]; e < rows.starts[v + 1]; ++e) {
      for (int c = 0; c < 3; ++c) sums[v][c] += rows.weights[e] * values[rows.columns[e]][c];
    }
  }
  return sums;
}

Interpolation<float> fitted_interpolation(const TriangleMesh& surface) {
  const Fit fit(surface);
  Interpolation<float> rows;
  rows.coarse_rows = static_cast<int>(surface.triangles.size());
  for (std::size_t v = 0; v < surface.vertices.size(); ++v) fit.add_row(static_cast<int>(v), rows);
  return rows;
}

}  // namespace opaline::render
