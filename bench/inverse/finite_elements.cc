#include "bench/inverse/finite_elements.h"

#include <Eigen/IterativeLinearSolvers>
#include <Eigen/Sparse>
#include <array>
#include <cmath>
#include <vector>

#include "reconstruct/diffusion/boundary.h"
#include "reconstruct/diffusion/camera_equation.h"

namespace opaline::bench {
namespace {

namespace diffusion = reconstruct::diffusion;
using Matrix = Eigen::SparseMatrix<double, Eigen::RowMajor>;
using Corners = std::array<Eigen::Index, 8>;

/// Two elements a cell along each axis.
struct Mesh {
  Block cells;
  int nx = 0, ny = 0, nz = 0;           // elements
  double hx = 0.0, hy = 0.0, hz = 0.0;  // of an element, mm
  Eigen::Index node(int i, int j, int k) const {
    return (static_cast<Eigen::Index>(k) * (ny + 1) + j) * (nx + 1) + i;
  }
  Eigen::Index node_count() const { return node(nx, ny, nz) + 1; }
  std::size_t cell_of(int i, int j, int k) const { return cells.index(i / 2, j / 2, k / 2); }
  /// The corners of an element, x fastest.
  Corners corners(int i, int j, int k) const {
    Corners c{};
    for (int n = 0; n < 8; ++n)
      c[static_cast<std::size_t>(n)] = node(i + (n & 1), j + (n >> 1 & 1), k + (n >> 2));
    return c;
  }
};

Mesh make_mesh(const Block& b) {
  return {b, 2 * b.nx, 2 * b.ny, 2 * b.nz, b.hx / 2, b.hy / 2, b.hz / 2};
}

using Local = std::array<std::array<double, 8>, 8>;

/// int grad v_a . grad v_b and int v_a v_b over one element: products of the one-dimensional integrals of linear functions.
void element_integrals(const Mesh& mesh, Local& stiffness, Local& mass) {
  const std::array<double, 3> h{mesh.hx, mesh.hy, mesh.hz};
  for (int a = 0; a < 8; ++a)
    for (int b = 0; b < 8; ++b) {
      std::array<double, 3> m{};
      std::array<double, 3> s{};
      for (int axis = 0; axis < 3; ++axis) {
        const bool same = (a >> axis & 1) == (b >> axis & 1);
        m[static_cast<std::size_t>(axis)] =
            h[static_cast<std::size_t>(axis)] * (same ? 2 : 1) / 6.0;
        s[static_cast<std::size_t>(axis)] = (same ? 1.0 : -1.0) / h[static_cast<std::size_t>(axis)];
      }
      stiffness[static_cast<std::size_t>(a)][static_cast<std::size_t>(b)] =
          s[0] * m[1] * m[2] + m[0] * s[1] * m[2] + m[0] * m[1] * s[2];
      mass[static_cast<std::size_t>(a)][static_cast<std::size_t>(b)] = m[0] * m[1] * m[2];
    }
}

using Triplets = std::vector<Eigen::Triplet<double>>;

/// int v_a v_b / (2 A) over the surface rectangles of one pair of opposite faces, perpendicular to `axis`.
void add_surface(const Mesh& mesh, int axis, double a, Triplets& entries) {
  const std::array<int, 3> count{mesh.nx, mesh.ny, mesh.nz};
  const std::array<double, 3> h{mesh.hx, mesh.hy, mesh.hz};
  const auto u = static_cast<std::size_t>((axis + 1) % 3);
  const auto v = static_cast<std::size_t>((axis + 2) % 3);
  for (const int side : {0, count[static_cast<std::size_t>(axis)]})
    for (int p = 0; p < count[u]; ++p)
      for (int q = 0; q < count[v]; ++q)
        for (int m = 0; m < 4; ++m)
          for (int n = 0; n < 4; ++n) {
            const auto at = [&](int corner) {
              std::array<int, 3> ijk{};
              ijk[static_cast<std::size_t>(axis)] = side;
              ijk[u] = p + (corner & 1);
              ijk[v] = q + (corner >> 1);
              return mesh.node(ijk[0], ijk[1], ijk[2]);
            };
            const double along_u = h[u] * ((m & 1) == (n & 1) ? 2 : 1) / 6.0;
            const double along_v = h[v] * ((m >> 1) == (n >> 1) ? 2 : 1) / 6.0;
            entries.emplace_back(at(m), at(n), along_u * along_v / (2.0 * a));
          }
}

Matrix assemble(const Mesh& mesh, const ChannelCoefficients& c, double a) {
  Local stiffness{};
  Local mass{};
  element_integrals(mesh, stiffness, mass);
  Triplets entries;
  entries.reserve(static_cast<std::size_t>(mesh.nx) * mesh.ny * mesh.nz * 64);
  for (int k = 0; k < mesh.nz; ++k)
    for (int j = 0; j < mesh.ny; ++j)
      for (int i = 0; i < mesh.nx; ++i) {
        const std::size_t cell = mesh.cell_of(i, j, k);
        const double kappa = 1.0 / (3.0 * (c.absorption[cell] + c.reduced_scattering[cell]));
        const Corners nodes = mesh.corners(i, j, k);
        for (std::size_t m = 0; m < 8; ++m)
          for (std::size_t n = 0; n < 8; ++n)
            entries.emplace_back(
                nodes[m], nodes[n], kappa * stiffness[m][n] + c.absorption[cell] * mass[m][n]);
      }
  for (int axis = 0; axis < 3; ++axis) add_surface(mesh, axis, a, entries);
  Matrix matrix(mesh.node_count(), mesh.node_count());
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

/// int Q v of a perpendicular ray bundle of irradiance q, transmitted, through the elements above (i, j).
void add_ray(
    const Mesh& mesh, const ChannelCoefficients& c, int i, int j, double q, Eigen::VectorXd& load) {
  double arriving = q * mesh.hx * mesh.hy;  // W
  for (int k = 0; k < mesh.nz; ++k) {
    const std::size_t cell = mesh.cell_of(i, j, k);
    const double extinction = c.absorption[cell] + c.reduced_scattering[cell];
    const double t = extinction * mesh.hz;
    const double scattered = arriving * -std::expm1(-t) * c.reduced_scattering[cell] / extinction;
    const double far = t < 1e-4 ? 0.5 - t / 12.0 : 1.0 / t - 1.0 / std::expm1(t);  // centroid / hz
    const Corners nodes = mesh.corners(i, j, k);
    for (std::size_t n = 0; n < 8; ++n)
      load[nodes[n]] += scattered / 4.0 * (n < 4 ? 1.0 - far : far);
    arriving *= std::exp(-t);
  }
}

double normal_transmittance(double ior) { return 1.0 - std::pow((ior - 1.0) / (ior + 1.0), 2); }

/// The flux through each cell of z_max, then the radiance to the camera.
void observe(const Mesh& mesh,
             const Eigen::VectorXd& phi,
             const diffusion::Boundary& boundary,
             double ior,
             Vec3 camera,
             int channel,
             Image<float>& radiance) {
  constexpr std::array kWeights{0.25, 0.5, 0.25};  // the mean of two linear pieces
  for (int y = 0; y < mesh.cells.ny; ++y)
    for (int x = 0; x < mesh.cells.nx; ++x) {
      double mean = 0.0;
      for (int j = 0; j < 3; ++j)
        for (int i = 0; i < 3; ++i)
          mean += kWeights[static_cast<std::size_t>(i)] * kWeights[static_cast<std::size_t>(j)] *
                  phi[mesh.node(2 * x + i, 2 * y + j, mesh.nz)];
      const Vec3 to = normalized(camera - mesh.cells.face_cell_centre(Face::kZMax, x, y));
      const double gain = diffusion::camera_equation(ior, boundary, to.z).flux_gain;
      radiance.at(x, y, channel) = static_cast<float>(gain * mean / (2.0 * boundary.a));
    }
}

TransportResponses empty_responses(const Material& material, int patches) {
  TransportResponses t;
  t.block = material.block;
  t.ior = material.ior;
  t.lit_face = Face::kZMin;
  t.seen_face = Face::kZMax;
  t.patches_x = t.patches_y = patches;
  const Vec3 size = material.block.size();
  t.camera_centre = {size.x / 2.0, size.y / 2.0, size.z + 300.0};
  t.generator = "trilinear finite elements";
  const PatchResponse dark{Image<float>(t.block.nx, t.block.ny, kColorChannels),
                           Image<float>(t.block.nx, t.block.ny, kColorChannels)};
  t.patches.assign(static_cast<std::size_t>(patches) * patches, dark);
  return t;
}

}  // namespace

TransportResponses finite_element_responses(const Material& material, int patches) {
  const Mesh mesh = make_mesh(material.block);
  const auto boundary =
      *diffusion::make_boundary(diffusion::BoundaryModel::kTwoMoment, material.ior);
  TransportResponses t = empty_responses(material, patches);
  for (std::size_t channel = 0; channel < kColorChannels; ++channel) {
    const ChannelCoefficients& c = material.channels[channel];
    const Matrix matrix = assemble(mesh, c, boundary.a);
#pragma omp parallel
    {
      Eigen::ConjugateGradient<
          Matrix,
          Eigen::Lower | Eigen::Upper,
          Eigen::IncompleteCholesky<double, Eigen::Lower, Eigen::NaturalOrdering<int>>>
          solver;
      solver.setTolerance(1e-9);
      solver.compute(matrix);
#pragma omp for schedule(dynamic)
      for (int patch = 0; patch < patches * patches; ++patch) {
        Eigen::VectorXd load = Eigen::VectorXd::Zero(mesh.node_count());
        for (int j = 0; j < mesh.ny; ++j)
          for (int i = 0; i < mesh.nx; ++i)
            if (i * patches / mesh.nx == patch % patches &&
                j * patches / mesh.ny == patch / patches)
              add_ray(mesh, c, i, j, normal_transmittance(material.ior), load);
        const Eigen::VectorXd phi = solver.solve(load);
        observe(mesh,
                phi,
                boundary,
                material.ior,
                t.camera_centre,
                static_cast<int>(channel),
                t.patches[static_cast<std::size_t>(patch)].radiance);
      }
    }
  }
  return t;
}

}  // namespace opaline::bench
