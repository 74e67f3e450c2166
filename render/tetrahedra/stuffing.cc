#include "render/tetrahedra/stuffing.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "render/tetrahedra/bcc_lattice.h"
#include "render/tetrahedra/cut_lattice.h"
#include "render/tetrahedra/octree.h"
#include "render/tetrahedra/stencils.h"

namespace opaline::render {
namespace {

TetMesh keep_used(const std::vector<Vec3>& points, std::vector<std::array<int, 4>> tets) {
  TetMesh mesh;
  std::vector<int> number(points.size(), -1);
  for (auto& tet : tets) {
    for (int& v : tet) {
      if (number[v] < 0) {
        number[v] = static_cast<int>(mesh.vertices.size());
        mesh.vertices.push_back(points[v]);
      }
      v = number[v];
    }
  }
  mesh.tets = std::move(tets);
  return mesh;
}

void orient(TetMesh& mesh) {
  for (std::size_t t = 0; t < mesh.tets.size(); ++t) {
    if (volume_of(mesh, t) < 0.0) std::swap(mesh.tets[t][2], mesh.tets[t][3]);
  }
}

}  // namespace

Result<TetMesh> stuff(const SignedDistance& solid,
                      const StuffingOptions& options,
                      std::stop_token stop) {
  const auto tree = Octree::create(solid,
                                   {.spacing_mm = options.spacing_mm,
                                    .interior_growth = options.interior_growth,
                                    .most_cells = options.most_tets / 12 * 2 + 1000},
                                   stop);
  if (!tree) return tree.error();
  const BackgroundLattice lattice = fill(*tree);
  auto cut = CutLattice::create(*tree, lattice, solid, stop);
  if (!cut) return cut.error();
  std::vector<std::array<int, 4>> tets = apply_stencils(lattice, *cut);
  if (tets.empty()) {
    return invalid_argument(
        fmt::format("nothing of the solid is left in cells "
                    "of {} mm: choose a smaller spacing",
                    options.spacing_mm));
  }
  if (tets.size() > options.most_tets) {
    return invalid_argument(fmt::format(
        "{} tetrahedra; at most {}: choose a larger spacing", tets.size(), options.most_tets));
  }
  TetMesh mesh = keep_used(cut->points, std::move(tets));
  orient(mesh);
  return mesh;
}

double spacing_for(double volume_mm3, double tets) { return std::cbrt(12.0 * volume_mm3 / tets); }

double estimate_volume(const SignedDistance& solid, int points) {
  const Box box = solid.bounds();
  const Vec3 size = box.size();
  const double thinnest = std::max({size.x, size.y, size.z}) / points;  // of a sheet or a needle
  if (!(thinnest > 0.0)) return 0.0;
  const double step = std::cbrt(std::max(size.x, thinnest) * std::max(size.y, thinnest) *
                                std::max(size.z, thinnest) / points);
  const auto count = [step](double length) { return std::max(1, static_cast<int>(length / step)); };
  const int nx = count(size.x);
  const int ny = count(size.y);
  const int nz = count(size.z);
  std::size_t inside = 0;
  for (int k = 0; k < nz; ++k) {
    for (int j = 0; j < ny; ++j) {
      for (int i = 0; i < nx; ++i) {
        inside += solid.at(box.low + Vec3{(i + 0.5) / nx * size.x,
                                          (j + 0.5) / ny * size.y,
                                          (k + 0.5) / nz * size.z}) < 0.0;
      }
    }
  }
  return size.x * size.y * size.z * static_cast<double>(inside) /
         (static_cast<double>(nx) * ny * nz);
}

}  // namespace opaline::render
