#include "render/graph/finite_elements.h"

#include <fmt/format.h>

#include <algorithm>

namespace opaline::render {
namespace {

struct Term {
  int row = 0;
  int column = 0;
  Lanes<double> value;
};

/// Sums terms of equal place into the matrix; terms on the diagonal belong to
/// the row's sum as all do.
LaneMatrix<double> gather(std::vector<Term> terms, std::vector<Lanes<double>> sinks) {
  LaneMatrix<double> matrix;
  matrix.sinks = std::move(sinks);
  std::ranges::sort(terms, {}, [](const Term& t) { return std::pair(t.row, t.column); });
  std::size_t i = 0;
  for (int row = 0; row < matrix.rows(); ++row) {
    while (i < terms.size() && terms[i].row == row) {
      const int column = terms[i].column;
      Lanes<double> sum = Lanes<double>::zero();
      for (; i < terms.size() && terms[i].row == row && terms[i].column == column; ++i)
        sum += terms[i].value;
      matrix.columns.push_back(column);
      matrix.entries.push_back(sum);
    }
    matrix.starts.push_back(static_cast<int>(matrix.columns.size()));
  }
  return matrix;
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
    : mesh_(&mesh),
      boundary_(boundary),
      surface_(surface_of(mesh)),
      areas_(mesh.vertices.size(), 0.0) {
  for (const auto& triangle : surface_) {
    for (const int v : triangle) areas_[v] += area_of(mesh, triangle) / 3.0;
  }
}

Result<FiniteElements> FiniteElements::create(const TetMesh& mesh,
                                              std::span<const Optics> optics,
                                              const reconstruct::diffusion::Boundary& boundary) {
  if (optics.size() != mesh.tets.size()) {
    return invalid_argument(
        fmt::format("{} places of material for {} tetrahedra", optics.size(), mesh.tets.size()));
  }
  if (auto valid = validate(optics); !valid) return valid.error();
  FiniteElements elements(mesh, boundary);
  elements.assemble(optics);
  return elements;
}

void FiniteElements::assemble(std::span<const Optics> optics) {
  std::vector<Term> terms;
  terms.reserve(12 * mesh_->tets.size() + 6 * surface_.size());
  std::vector<Lanes<double>> sinks(mesh_->vertices.size(), Lanes<double>::zero());
  for (std::size_t t = 0; t < mesh_->tets.size(); ++t) {
    const Element element = element_of(*mesh_, t);
    for (int i = 0; i < 4; ++i) {
      for (int c = 0; c < 3; ++c) {
        Lanes<double>& sink = sinks[mesh_->tets[t][i]];
        sink.set(c, sink[c] + 0.25 * element.volume * optics[t].absorption[c]);
      }
      for (int k = 0; k < 4; ++k) {
        if (k == i) continue;
        const double stiffness = element.volume * dot(element.gradients[i], element.gradients[k]);
        Lanes<double> value = Lanes<double>::zero();
        for (int c = 0; c < 3; ++c) {
          value.set(
              c,
              stiffness * optics[t].diffusion[c] + element.volume / 20.0 * optics[t].absorption[c]);
        }
        terms.push_back({mesh_->tets[t][i], mesh_->tets[t][k], value});
      }
    }
  }
  for (const auto& triangle : surface_) {
    const double mass = area_of(*mesh_, triangle) / (24.0 * boundary_.a);  // area / 12 over 2 A
    for (int i = 0; i < 3; ++i) {
      sinks[triangle[i]] += Lanes<double>::all(4.0 * mass);
      for (int k = 0; k < 3; ++k) {
        if (k != i) terms.push_back({triangle[i], triangle[k], Lanes<double>::all(mass)});
      }
    }
  }
  matrix_ = gather(std::move(terms), std::move(sinks));
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
