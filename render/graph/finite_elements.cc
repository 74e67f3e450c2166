#include "render/graph/finite_elements.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "base/ensure.h"

namespace opaline::render {
namespace {

/// Which vertices share a tetrahedron: the columns of each row, rising.
LaneMatrix<double> pattern_of(const TetMesh& mesh) {
  std::vector<std::pair<int, int>> pairs;
  pairs.reserve(12 * mesh.tets.size());
  for (const auto& tet : mesh.tets) {
    for (int i = 0; i < 4; ++i) {
      for (int k = 0; k < 4; ++k) {
        if (k != i) pairs.emplace_back(tet[i], tet[k]);
      }
    }
  }
  std::ranges::sort(pairs);
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  LaneMatrix<double> matrix;
  matrix.sinks.resize(mesh.vertices.size(), Lanes<double>::zero());
  matrix.entries.resize(pairs.size(), Lanes<double>::zero());
  matrix.starts.assign(mesh.vertices.size() + 1, 0);
  for (const auto& [row, column] : pairs) {
    matrix.columns.push_back(column);
    ++matrix.starts[row + 1];
  }
  std::partial_sum(matrix.starts.begin(), matrix.starts.end(), matrix.starts.begin());
  return matrix;
}

Lanes<double>& entry(LaneMatrix<double>& matrix, int row, int column) {
  const auto first = matrix.columns.begin() + matrix.starts[row];
  const auto place =
      std::lower_bound(first, matrix.columns.begin() + matrix.starts[row + 1], column);
  return matrix.entries[place - matrix.columns.begin()];
}

/// Gradients of the four shape functions, and the volume.
struct Element {
  std::array<Vec3, 4> gradients;
  double volume = 0.0;
};

Element element_of(const TetMesh& mesh, std::size_t tet) {
  Element element;
  element.volume = volume_of(mesh, tet);
  for (int k = 0; k < 4; ++k) {
    const auto face = face_of(mesh.tets[tet], k);
    const Vec3 a = mesh.vertices[face[0]];
    const Vec3 outwards = cross(mesh.vertices[face[1]] - a,
                                mesh.vertices[face[2]] - a);  // twice the area long
    element.gradients[k] = outwards * (-1.0 / (6.0 * element.volume));
  }
  return element;
}

double area_of(const TetMesh& mesh, const std::array<int, 3>& t) {
  const Vec3 a = mesh.vertices[t[0]];
  return 0.5 * length(cross(mesh.vertices[t[1]] - a, mesh.vertices[t[2]] - a));
}

}  // namespace

FiniteElements::FiniteElements(const TetMesh& mesh,
                               const reconstruct::diffusion::Boundary& boundary)
    : mesh_(&mesh), boundary_(boundary), surface_(surface_of(mesh)), matrix_(pattern_of(mesh)) {
  for (const auto& triangle : surface_) {
    for (int k = 0; k < 3; ++k) {
      const auto [low, high] = std::minmax(triangle[k], triangle[(k + 1) % 3]);
      edges_.push_back({low, high});
    }
  }
  std::ranges::sort(edges_);
  edges_.erase(std::unique(edges_.begin(), edges_.end()), edges_.end());
  for (const auto& triangle : surface_) {
    auto& own = edges_of_.emplace_back();
    for (int k = 0; k < 3; ++k) {
      const auto [low, high] = std::minmax(triangle[k], triangle[(k + 1) % 3]);
      const auto at = std::ranges::lower_bound(edges_, std::array<int, 2>{low, high});
      own[k] = static_cast<int>(at - edges_.begin());
    }
  }
}

Result<FiniteElements> FiniteElements::create(const TetMesh& mesh,
                                              std::span<const Optics> optics,
                                              const reconstruct::diffusion::Boundary& boundary) {
  FiniteElements elements(mesh, boundary);
  if (auto taken = elements.update(optics); !taken) return taken.error();
  return elements;
}

Result<void> FiniteElements::update(std::span<const Optics> optics) {
  if (optics.size() != mesh_->tets.size()) {
    return invalid_argument(
        fmt::format("{} places of material for {} tetrahedra", optics.size(), mesh_->tets.size()));
  }
  if (auto valid = validate(optics); !valid) return valid.error();
  std::ranges::fill(matrix_.entries, Lanes<double>::zero());
  std::ranges::fill(matrix_.sinks, Lanes<double>::zero());
  for (std::size_t t = 0; t < mesh_->tets.size(); ++t) add_volume(t, optics[t]);
  areas_.assign(mesh_->vertices.size(), 0.0);
  for (const auto& triangle : surface_) add_surface(triangle);
  return ok();
}

void FiniteElements::add_volume(std::size_t tet, const Optics& optics) {
  const Element element = element_of(*mesh_, tet);
  const auto& corners = mesh_->tets[tet];
  for (int i = 0; i < 4; ++i) {
    Lanes<double>& sink = matrix_.sinks[corners[i]];
    for (int c = 0; c < 3; ++c) {
      sink.set(c, sink[c] + 0.25 * element.volume * optics.absorption[c]);
    }
    for (int k = 0; k < 4; ++k) {
      if (k == i) continue;
      const double stiffness = element.volume * dot(element.gradients[i], element.gradients[k]);
      Lanes<double> value = Lanes<double>::zero();
      for (int c = 0; c < 3; ++c) {
        value.set(c,
                  stiffness * optics.diffusion[c] + element.volume / 20.0 * optics.absorption[c]);
      }
      entry(matrix_, corners[i], corners[k]) += value;
    }
  }
}

void FiniteElements::add_surface(const std::array<int, 3>& triangle) {
  const double area = area_of(*mesh_, triangle);
  const double mass = area / (24.0 * boundary_.a);  // area / 12 over 2 A
  for (int i = 0; i < 3; ++i) {
    areas_[triangle[i]] += area / 3.0;
    matrix_.sinks[triangle[i]] += Lanes<double>::all(4.0 * mass);
    for (int k = 0; k < 3; ++k) {
      if (k != i) entry(matrix_, triangle[i], triangle[k]) += Lanes<double>::all(mass);
    }
  }
}

std::vector<Lanes<double>> FiniteElements::load(std::span<const std::array<float, 3>> q) const {
  std::vector<Lanes<double>> b(mesh_->vertices.size(), Lanes<double>::zero());
  for (const auto& triangle : surface_) {
    const double mass = area_of(*mesh_, triangle) / (24.0 * boundary_.a) * boundary_.source_scale;
    for (int i = 0; i < 3; ++i) {
      for (int k = 0; k < 3; ++k) {
        for (int c = 0; c < 3; ++c) {
          Lanes<double>& sum = b[triangle[i]];
          sum.set(c, sum[c] + mass * (i == k ? 2.0 : 1.0) * q[triangle[k]][c]);
        }
      }
    }
  }
  return b;
}

std::vector<Lanes<double>> FiniteElements::load(
    std::span<const std::array<float, 3>> q, std::span<const std::array<int, 6>> places_of) const {
  ENSURE(places_of.size() == surface_.size());
  // Of the four quarters together, int q v dA / area, times 96: of a corner and of a middle, for the v of ...
  constexpr double kOwnCorner = 6.0;
  constexpr double kOtherCorner = 1.0;
  constexpr double kMiddleBeside = 10.0;
  constexpr double kMiddleAcross = 4.0;
  std::vector<Lanes<double>> b(mesh_->vertices.size(), Lanes<double>::zero());
  for (std::size_t t = 0; t < surface_.size(); ++t) {
    const auto& triangle = surface_[t];
    const double mass =
        area_of(*mesh_, triangle) / 96.0 / (2.0 * boundary_.a) * boundary_.source_scale;
    for (int i = 0; i < 3; ++i) {
      Lanes<double>& sum = b[triangle[i]];
      for (int k = 0; k < 3; ++k) {
        const double corner = mass * (i == k ? kOwnCorner : kOtherCorner);
        const double middle = mass * (k == (i + 1) % 3 ? kMiddleAcross : kMiddleBeside);
        for (int c = 0; c < 3; ++c) {
          sum.set(c, sum[c] + corner * q[places_of[t][k]][c] + middle * q[places_of[t][3 + k]][c]);
        }
      }
    }
  }
  return b;
}

SurfaceLight FiniteElements::surface_light(std::span<const std::array<float, 3>> q,
                                           const std::vector<Lanes<double>>& phi) const {
  const std::size_t count = mesh_->vertices.size();
  SurfaceLight light{std::vector<std::array<float, 3>>(count),
                     std::vector<std::array<float, 3>>(count)};
  for (std::size_t v = 0; v < count; ++v) {
    for (int c = 0; c < 3 && areas_[v] > 0.0; ++c) {
      const double source = boundary_.source_scale * q[v][c];
      light.fluence[v][c] = static_cast<float>(phi[v][c]);
      light.net_flux[v][c] = static_cast<float>((phi[v][c] - source) / (2.0 * boundary_.a));
    }
  }
  return light;
}

}  // namespace opaline::render
