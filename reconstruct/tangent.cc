#include "reconstruct/tangent.h"

#include <array>
#include <cmath>

#include "base/ensure.h"
#include "reconstruct/diffusion/medium.h"
#include "reconstruct/solve_check.h"

namespace opaline::reconstruct {
namespace {

using diffusion::FieldBatch;
using diffusion::MediumChange;

// dkappa = -3 kappa^2 (dsigma_s' + dsigma_a), the moves in logarithms.
MediumChange change_of(const ChannelCoefficients& c,
                       const diffusion::Medium& medium,
                       std::span<const double> v) {
  const std::size_t cells = c.absorption.size();
  MediumChange change{std::vector<double>(cells), std::vector<double>(cells)};
  for (std::size_t i = 0; i < cells; ++i) {
    const double kappa = medium.diffusion[i];
    change.absorption[i] = c.absorption[i] * v[cells + i];
    change.diffusion[i] =
        -3.0 * kappa * kappa * (c.reduced_scattering[i] * v[i] + change.absorption[i]);
  }
  return change;
}

/// dK: the seven-point matrix with the derivatives of its conductances, zero beyond the block.
class MatrixChange {
 public:
  MatrixChange(const diffusion::Medium& medium,
               const diffusion::Boundary& boundary,
               const MediumChange& change)
      : offsets_{1,
                 static_cast<std::size_t>(medium.block.nx),
                 static_cast<std::size_t>(medium.block.nx) * medium.block.ny},
        diagonal_(change.absorption) {
    const Block& block = medium.block;
    for (double& d : diagonal_) d *= block.cell_volume();
    for (const Face face : kFaces) {
      const auto moved = diffusion::conductance_change(medium, boundary, face, change);
      std::size_t f = 0;
      for (int row = 0; row < block.face_height(face); ++row)
        for (int column = 0; column < block.face_width(face); ++column, ++f)
          diagonal_[block.cell_behind(face, column, row)] += block.face_cell_area(face) * moved[f];
    }
    for (std::size_t axis = 0; axis < 3; ++axis) add_links(axis, medium, change);
  }

  /// b -= dK phi.
  void subtract(const double* phi, double* b) const {
    for (std::size_t i = 0; i < diagonal_.size(); ++i) b[i] -= diagonal_[i] * phi[i];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::size_t offset = offsets_[axis];
      const double* link = links_[axis].data();
      for (std::size_t i = 0; i + offset < diagonal_.size(); ++i) {
        const double flow = link[i] * (phi[i] - phi[i + offset]);
        b[i] -= flow;
        b[i + offset] += flow;
      }
    }
  }

 private:
  // d(a kappa_f / h), kappa_f = 2 ki kj / (ki + kj), between each cell and the next along the axis.
  void add_links(std::size_t axis, const diffusion::Medium& medium, const MediumChange& change) {
    const Block& block = medium.block;
    const double h = block.spacing()[axis];
    const double scale = 2.0 * block.cell_volume() / (h * h);
    const std::size_t offset = offsets_[axis];
    const auto& kappa = medium.diffusion;
    links_[axis].assign(block.cell_count(), 0.0);
    for (int k = 0; k < block.nz - (axis == 2 ? 1 : 0); ++k) {
      for (int j = 0; j < block.ny - (axis == 1 ? 1 : 0); ++j) {
        const std::size_t row = block.index(0, j, k);
        const std::size_t end = row + static_cast<std::size_t>(block.nx - (axis == 0 ? 1 : 0));
        for (std::size_t i = row; i < end; ++i) {
          const std::size_t n = i + offset;
          const double sum = kappa[i] + kappa[n];
          links_[axis][i] = scale / (sum * sum) *
                            (kappa[n] * kappa[n] * change.diffusion[i] +
                             kappa[i] * kappa[i] * change.diffusion[n]);
        }
      }
    }
  }

  std::array<std::size_t, 3> offsets_;
  std::vector<double> diagonal_;
  std::array<std::vector<double>, 3> links_;
};

}  // namespace

Tangent::Tangent(const ChannelProblem& problem,
                 diffusion::FluenceSolver& solver,
                 const ChannelCoefficients& coefficients,
                 FieldBatch fluence,
                 double tolerance)
    : problem_(&problem),
      solver_(&solver),
      coefficients_(coefficients),
      lit_(problem, coefficients),
      fluence_(std::move(fluence)),
      tolerance_(tolerance) {}

Result<Tangent> Tangent::at(const ChannelProblem& problem,
                            diffusion::FluenceSolver& solver,
                            const ChannelCoefficients& coefficients,
                            double tolerance,
                            std::stop_token stop) {
  Tangent tangent(problem, solver, coefficients, {}, tolerance);
  if (auto prepared = solver.prepare(tangent.lit_.medium); !prepared) return prepared.error();
  auto fluence = tangent.solve(tangent.lit_.right_sides(problem), std::move(stop));
  if (!fluence) return fluence.error();
  tangent.fluence_ = *std::move(fluence);
  return tangent;
}

Result<FieldBatch> Tangent::solve(const FieldBatch& b, std::stop_token stop) {
  FieldBatch x(b.cells, b.count);
  const auto summary = solver_->solve(b, x, {.tolerance = tolerance_}, std::move(stop));
  if (!summary) return summary.error();
  solves_ += b.count;
  if (auto useful = check_useful(*summary); !useful) return useful.error();
  return x;
}

FieldBatch Tangent::moved_right_sides(const MediumChange& change,
                                      std::vector<std::vector<double>>& escape) const {
  const MatrixChange matrix(lit_.medium, problem_->boundary, change);
  FieldBatch b(fluence_.cells, fluence_.count);
  for (std::size_t m = 0; m < problem_->illuminations.size(); ++m) {
    const auto& q = problem_->illuminations[m].irradiance;
    const int field = static_cast<int>(m);
    escape.emplace_back(q.size(), 0.0);
    lit_.light.add_tangent(q, change, {b.field(field), b.cells}, escape.back());
    matrix.subtract(fluence_.field(field), b.field(field));
  }
  return b;
}

Result<std::vector<double>> Tangent::apply(std::span<const double> v, std::stop_token stop) {
  ENSURE(v.size() == parameter_count());
  const MediumChange change = change_of(coefficients_, lit_.medium, v);
  std::vector<std::vector<double>> escape;
  const auto moved = solve(moved_right_sides(change, escape), std::move(stop));
  if (!moved) return moved.error().in("tangent");
  const auto pictures = radiance_change(*problem_, lit_, fluence_, change, *moved, escape);
  std::vector<double> out;
  out.reserve(data_count());
  for (std::size_t m = 0; m < pictures.size(); ++m) {
    const auto& weight = problem_->illuminations[m].weight;
    for (std::size_t f = 0; f < weight.size(); ++f)
      out.push_back(std::sqrt(weight[f]) * pictures[m][f]);
  }
  return out;
}

Result<std::vector<double>> Tangent::apply_adjoint(std::span<const double> y,
                                                   std::stop_token stop) {
  ENSURE(y.size() == data_count());
  const std::size_t pixels = problem_->camera.size();
  RadianceResiduals residuals;
  for (std::size_t m = 0; m < problem_->illuminations.size(); ++m) {
    const auto& weight = problem_->illuminations[m].weight;
    auto& r = residuals.emplace_back(pixels);
    for (std::size_t f = 0; f < pixels; ++f) r[f] = std::sqrt(weight[f]) * y[m * pixels + f];
  }
  const auto adjoint = solve(adjoint_right_sides(*problem_, lit_, residuals), std::move(stop));
  if (!adjoint) return adjoint.error().in("adjoint");
  auto gradient = medium_gradient(*problem_, lit_, fluence_, *adjoint, residuals);
  for (std::size_t i = 0; i < gradient.diffusion.size(); ++i) {
    gradient.diffusion[i] *= lit_.medium.diffusion[i];
    gradient.absorption[i] *= coefficients_.absorption[i];
  }
  return to_parameter_gradient(coefficients_, gradient);
}

std::vector<double> Tangent::residual() const {
  const auto pictures = radiance(*problem_, lit_, fluence_);
  std::vector<double> out;
  out.reserve(data_count());
  for (std::size_t m = 0; m < pictures.size(); ++m) {
    const ChannelIllumination& data = problem_->illuminations[m];
    for (std::size_t f = 0; f < pictures[m].size(); ++f)
      out.push_back(std::sqrt(data.weight[f]) * (pictures[m][f] - data.radiance[f]));
  }
  return out;
}

}  // namespace opaline::reconstruct
