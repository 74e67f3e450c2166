#include "render/graph/surface_fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <span>
#include <vector>

#include "render/graph/nearest.h"

namespace opaline::render {
namespace {

constexpr int kTerms = 6;
constexpr int kNearest = 48;        // samples that are not a mesh's triangles; about three rings
constexpr int kFirstRing = 6;       // of those
constexpr double kReach = 1.5;      // of the mean distance of the first ring
constexpr double kFaces = 0.3;      // cosine between a sample's normal and the vertex's
constexpr double kSingular = 1e-3;  // of a pivot, relative to its diagonal
constexpr double kMostWeight =
    3.0;  // sum of |weights| beyond which values' errors would be amplified

using Terms = std::array<double, kTerms>;
using Moments = std::array<Terms, kTerms>;

struct Near {
  int sample = 0;
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

/// Weights of the samples in the polynomial of `count` terms at the vertex.
std::optional<std::vector<float>> weights_of(const std::vector<Near>& near, int count) {
  Moments moments{};
  for (const Near& m : near) {
    for (int i = 0; i < count; ++i) {
      for (int j = 0; j < count; ++j) moments[i][j] += m.weight * m.terms[i] * m.terms[j];
    }
  }
  const auto row = first_row_of_inverse(moments, count);
  if (!row) return std::nullopt;
  std::vector<float> weights;
  double all = 0.0;
  for (const Near& m : near) {
    double sum = 0.0;
    for (int i = 0; i < count; ++i) sum += (*row)[i] * m.terms[i];
    weights.push_back(static_cast<float>(m.weight * sum));
    all += std::abs(m.weight * sum);
  }
  if (all > kMostWeight) return std::nullopt;
  return weights;
}

/// Adds a row: the polynomial at a place of a surface, through these of the samples.
void add_row(const std::vector<SurfaceSample>& samples,
             std::span<const int> around,
             Vec3 place,
             Vec3 normal,
             double reach,
             Interpolation<float>& rows) {
  const Vec3 u = normalized(std::abs(normal.x) < 0.6 ? cross(normal, {1.0, 0.0, 0.0})
                                                     : cross(normal, {0.0, 1.0, 0.0}));
  const Vec3 w = cross(normal, u);
  std::vector<Near> near;
  for (const int s : around) {
    const double size = length(samples[s].area);
    if (!(dot(samples[s].area, normal) > kFaces * size)) continue;
    const Vec3 way = (samples[s].place - place) * (1.0 / reach);
    const double x = dot(way, u);
    const double y = dot(way, w);
    near.push_back({s, size * std::exp(-dot(way, way)), {1.0, x, y, x * x, x * y, y * y}});
  }
  std::optional<std::vector<float>> weights;
  for (const int count : {6, 3, 1}) {
    if (!weights && std::ssize(near) >= count) weights = weights_of(near, count);
  }
  for (std::size_t n = 0; weights && n < near.size(); ++n) {
    rows.columns.push_back(near[n].sample);
    rows.weights.push_back((*weights)[n]);
  }
  rows.starts.push_back(static_cast<int>(rows.columns.size()));
}

/// The triangles of a mesh as samples, and which are around a vertex.
class Rings {
 public:
  explicit Rings(const TriangleMesh& surface)
      : surface_(surface), around_(surface.vertices.size()) {
    for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
      const auto& [i, j, k] = surface.triangles[t];
      const Vec3 a = surface.vertices[i];
      const Vec3 b = surface.vertices[j];
      const Vec3 c = surface.vertices[k];
      samples_.push_back({(a + b + c) * (1.0 / 3.0), cross(b - a, c - a) * 0.5});
      for (const int v : {i, j, k}) around_[v].push_back(static_cast<int>(t));
    }
  }

  const std::vector<SurfaceSample>& samples() const { return samples_; }

  std::vector<int> two_around(int vertex) const {
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

  /// The sum of the areas of a vertex's own triangles.
  Vec3 area_at(int vertex) const {
    Vec3 area{};
    for (const int t : around_[vertex]) area = area + samples_[t].area;
    return area;
  }

  /// The mean distance to the middles of a vertex's own triangles.
  double reach_of(int vertex) const {
    double sum = 0.0;
    for (const int t : around_[vertex]) {
      sum += length(samples_[t].place - surface_.vertices[vertex]);
    }
    return sum / static_cast<double>(around_[vertex].size());
  }

 private:
  const TriangleMesh& surface_;
  std::vector<std::vector<int>> around_;  // triangles of each vertex
  std::vector<SurfaceSample> samples_;
};

void add_empty_row(Interpolation<float>& rows) {
  rows.starts.push_back(static_cast<int>(rows.columns.size()));
}

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
  const Rings rings(surface);
  Interpolation<float> rows;
  rows.coarse_rows = static_cast<int>(surface.triangles.size());
  for (int v = 0; v < static_cast<int>(surface.vertices.size()); ++v) {
    const Vec3 area = rings.area_at(v);
    if (length(area) > 0.0) {
      add_row(rings.samples(),
              rings.two_around(v),
              surface.vertices[v],
              normalized(area),
              rings.reach_of(v),
              rows);
    } else {
      add_empty_row(rows);
    }
  }
  return rows;
}

Interpolation<float> fitted_interpolation(const std::vector<SurfaceSample>& samples,
                                          const TriangleMesh& surface) {
  const Rings rings(surface);
  std::vector<Vec3> places;
  for (const SurfaceSample& sample : samples) places.push_back(sample.place);
  const int count = std::min<int>(kNearest, static_cast<int>(places.size()));
  const auto nearest = nearest_interpolation(places, surface.vertices, count);
  Interpolation<float> rows;
  rows.coarse_rows = static_cast<int>(samples.size());
  for (int v = 0; v < static_cast<int>(surface.vertices.size()); ++v) {
    const Vec3 place = surface.vertices[v];
    const Vec3 area = rings.area_at(v);
    const std::span<const int> around(nearest.columns.data() + nearest.starts[v], count);
    double reach = 0.0;
    const int own = std::min(kFirstRing, count);
    for (const int s : around.first(own)) reach += kReach * length(places[s] - place) / own;
    if (length(area) > 0.0 && reach > 0.0) {
      add_row(samples, around, place, normalized(area), reach, rows);
    } else {
      add_empty_row(rows);
    }
  }
  return rows;
}

}  // namespace opaline::render
