#include "reconstruct/information.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <numeric>
#include <thread>

#include "reconstruct/adjoint.h"
#include "reconstruct/objective.h"
#include "reconstruct/resample.h"
#include "reconstruct/solve_check.h"

namespace opaline::reconstruct {
namespace {

using diffusion::FieldBatch;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kBatch = 32;                 // right-hand sides a solve
constexpr double kLeastScattering = 1e-6;  // 1/mm, where averaging leaves none

std::vector<double> less_mean(std::vector<double> u) {
  const double mean = std::accumulate(u.begin(), u.end(), 0.0) / static_cast<double>(u.size());
  for (double& v : u) v -= mean;
  return u;
}

void take_out(const MatrixXd& rows, const VectorXd& residual, NormalEquations& from) {
  from.hessian.selfadjointView<Eigen::Lower>().rankUpdate(rows, -1.0);
  from.gradient -= rows * residual;
  from.norm -= residual.squaredNorm();
}

}  // namespace

struct Information::Point {
  ChannelProblem problem;  // radiances are misfits
  ChannelProblem measured;
  ChannelCoefficients coefficients;
  std::vector<double> diffusion_less_mean;  // of the logarithms
  std::vector<double> absorption_less_mean;
  RadianceResiduals probes;  // one a cell of the seen face
  FieldBatch fluence;        // per illumination
  FieldBatch adjoint;        // per probe
};

Information::Information(const ChannelProblem& problem,
                         diffusion::FluenceSolver& solver,
                         const PosteriorOptions& options)
    : fine_(problem),
      solver_(solver),
      options_(options),
      grid_(coarser_block(problem.block, options.cells)),
      diffusion_(problem.block, grid_, options.length_mm, options.diffusion_modes),
      absorption_(problem.block, grid_, options.length_mm, options.absorption_modes),
      shapes_(grid_, problem.seen_face, mixing_length(problem.block, problem.seen_face)),
      discrepancies_(problem.illuminations.size()) {}

Result<ChannelProblem> Information::coarse_misfit(const ChannelCoefficients& estimate,
                                                  std::stop_token stop) {
  Objective objective(fine_, solver_, {options_.tolerance, 0.0});
  const auto predicted = objective.predict(estimate, std::move(stop));
  if (!predicted) return predicted.error();
  solves_ += objective.solves();
  ChannelProblem misfit = fine_;
  for (std::size_t m = 0; m < predicted->size(); ++m) {
    auto& radiance = misfit.illuminations[m].radiance;
    for (std::size_t x = 0; x < radiance.size(); ++x)
      radiance[x] = (*predicted)[m][x] - radiance[x];
  }
  return coarsen(misfit, grid_);
}

Result<void> Information::gather(const ChannelCoefficients& estimate, std::stop_token stop) {
  auto misfit = coarse_misfit(estimate, stop);
  if (!misfit) return misfit.error();
  std::vector<double> diffusion;
  std::vector<double> absorption;
  for (std::size_t i = 0; i < estimate.absorption.size(); ++i) {
    diffusion.push_back(-std::log(3.0 * (estimate.absorption[i] + estimate.reduced_scattering[i])));
    absorption.push_back(std::log(estimate.absorption[i]));
  }
  diffusion = average_cells(fine_.block, grid_, std::move(diffusion));
  absorption = average_cells(fine_.block, grid_, std::move(absorption));
  Point at;
  at.problem = *std::move(misfit);
  at.measured = coarsen(fine_, grid_);
  for (std::size_t i = 0; i < diffusion.size(); ++i) {
    at.coefficients.absorption.push_back(std::exp(absorption[i]));
    at.coefficients.reduced_scattering.push_back(
        std::max(std::exp(-diffusion[i]) / 3.0 - at.coefficients.absorption[i], kLeastScattering));
  }
  at.diffusion_less_mean = diffusion_.kept_part(less_mean(std::move(diffusion)));
  at.absorption_less_mean = absorption_.kept_part(less_mean(std::move(absorption)));
  if (auto solved = solve_all(at, stop); !solved) return solved;
  add_all_rows(at, stop);
  if (stop.stop_requested()) return cancelled("posterior");
  if (!sums_.hessian.allFinite() || !sums_.gradient.allFinite())
    return internal_error("posterior: the Hessian is not finite");
  return ok();
}

Result<void> Information::solve_all(Point& at, std::stop_token stop) {
  const LitMedium lit(at.problem, at.coefficients);
  if (auto ready = solver_.prepare(lit.medium); !ready) return ready;
  auto fluence = solve(lit.right_sides(at.problem), stop);
  if (!fluence) return fluence.error();
  at.fluence = *std::move(fluence);
  const std::size_t pixels = at.problem.camera.size();
  at.probes.assign(pixels, std::vector<double>(pixels, 0.0));
  for (std::size_t x = 0; x < pixels; ++x) at.probes[x][x] = 1.0;
  auto adjoint = solve(adjoint_right_sides(at.problem, lit, at.probes), std::move(stop));
  if (!adjoint) return adjoint.error();
  at.adjoint = *std::move(adjoint);
  return ok();
}

Result<FieldBatch> Information::solve(const FieldBatch& b, std::stop_token stop) {
  FieldBatch x(b.cells, b.count);
  for (int first = 0; first < b.count; first += kBatch) {
    const int count = std::min(kBatch, b.count - first);
    FieldBatch some(b.cells, count);
    FieldBatch found(b.cells, count);
    std::copy_n(b.field(first), some.values.size(), some.values.begin());
    const auto summary = solver_.solve(some, found, {.tolerance = options_.tolerance}, stop);
    if (!summary) return summary.error();
    if (summary->termination == diffusion::Termination::kCancelled) return cancelled("posterior");
    if (auto useful = check_useful(*summary); !useful) return useful.error();
    std::copy_n(found.values.begin(), found.values.size(), x.field(first));
    solves_ += count;
  }
  return x;
}

// The rows of one picture: the adjoint gradient of each datum, from two Green's functions.
void Information::add_rows(const Point& at, std::size_t illumination, NormalEquations& sums) {
  ChannelProblem single = at.problem;
  single.illuminations = {at.problem.illuminations[illumination]};
  const ChannelIllumination& data = single.illuminations.front();
  const LitMedium lit(single, at.coefficients);
  FieldBatch phi(grid_.cell_count(), 1);
  FieldBatch psi(grid_.cell_count(), 1);
  std::copy_n(at.fluence.field(static_cast<int>(illumination)), phi.cells, phi.field(0));
  MatrixXd rows = MatrixXd::Zero(size(), static_cast<Index>(data.weight.size()));
  VectorXd g = VectorXd::Zero(rows.cols());
  for (std::size_t x = 0; x < data.weight.size(); ++x) {
    if (data.weight[x] == 0.0) continue;
    std::copy_n(at.adjoint.field(static_cast<int>(x)), psi.cells, psi.field(0));
    auto row = medium_gradient(single, lit, phi, psi, {at.probes[x]});
    const double root = std::sqrt(data.weight[x]);
    const auto column = static_cast<Index>(x);
    g[column] = -root * data.radiance[x];
    for (std::size_t i = 0; i < psi.cells; ++i) {
      row.diffusion[i] *= root * lit.medium.diffusion[i];
      row.absorption[i] *= root * at.coefficients.absorption[i];
      g[column] += row.diffusion[i] * at.diffusion_less_mean[i] +
                   row.absorption[i] * at.absorption_less_mean[i];
    }
    diffusion_.project(row.diffusion, rows.col(column).head(diffusion_.size()));
    absorption_.project(row.absorption, rows.col(column).tail(absorption_.size()));
  }
  sums.hessian.selfadjointView<Eigen::Lower>().rankUpdate(rows);
  sums.gradient += rows * g;
  sums.norm += g.squaredNorm();
  const MatrixXd shapes = shapes_.whitened(at.measured.illuminations[illumination]);
  const Eigen::SelfAdjointEigenSolver<MatrixXd> modes(shapes.transpose() * shapes);
  const MatrixXd turned = shapes * modes.eigenvectors();
  discrepancies_[illumination] = {rows * turned,
                                  turned.transpose() * g,
                                  modes.eigenvalues().cwiseMax(0.0),
                                  modes.eigenvectors()};
}

NormalEquations Information::normal_equations(double discrepancy) const {
  NormalEquations out = sums_;
  if (discrepancy == 0.0) return out;
  const double own = (1.0 - DiscrepancyShapes::kCommonShare) * discrepancy * discrepancy;
  const double shared = DiscrepancyShapes::kCommonShare * discrepancy * discrepancy;
  const Index shapes = shapes_.size();
  MatrixXd rows = MatrixXd::Zero(size(), shapes);
  MatrixXd strength = MatrixXd::Identity(shapes, shapes) / shared;
  VectorXd residual = VectorXd::Zero(shapes);
  for (const Discrepancy& d : discrepancies_) {
    const VectorXd left = (1.0 + own * d.strength.array()).inverse();
    const VectorXd root = (own * left.array()).sqrt();
    take_out(d.rows * root.asDiagonal(), root.cwiseProduct(d.residual), out);
    const MatrixXd turn = left.asDiagonal() * d.turn.transpose();
    rows += d.rows * turn;
    strength += d.turn * d.strength.asDiagonal() * turn;
    residual += turn.transpose() * d.residual;
  }
  const Eigen::LLT<MatrixXd> factors(strength);
  take_out(factors.matrixL().solve(rows.transpose()).transpose(),
           factors.matrixL().solve(residual),
           out);
  return out;
}

void Information::add_all_rows(const Point& at, std::stop_token stop) {
  const std::size_t pictures = at.problem.illuminations.size();
  const std::size_t asked =
      options_.threads > 0 ? options_.threads : std::max(1U, std::thread::hardware_concurrency());
  const std::size_t count = std::min({asked, pictures, std::size_t{8}});
  const NormalEquations zero{MatrixXd::Zero(size(), size()), VectorXd::Zero(size())};
  std::vector<NormalEquations> sums(count, zero);
  {
    std::vector<std::jthread> threads;
    for (std::size_t t = 0; t < count; ++t) {
      threads.emplace_back([&, t] {
        for (std::size_t m = t; m < pictures && !stop.stop_requested(); m += count)
          add_rows(at, m, sums[t]);
      });
    }
  }
  sums_ = std::move(sums.front());
  for (std::size_t t = 1; t < count; ++t) {
    sums_.hessian += sums[t].hessian;
    sums_.gradient += sums[t].gradient;
    sums_.norm += sums[t].norm;
  }
}

}  // namespace opaline::reconstruct
