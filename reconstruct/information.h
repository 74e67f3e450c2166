#pragma once

#include <Eigen/Core>
#include <stop_token>
#include <vector>

#include "base/result.h"
#include "reconstruct/channel_problem.h"
#include "reconstruct/diffusion/fluence_solver.h"
#include "reconstruct/discrepancy.h"
#include "reconstruct/posterior.h"
#include "reconstruct/prior.h"

namespace opaline::reconstruct {

/// Of least squares, |g - A y|^2 in the metric of the data's covariance R, whitened by the weights.
struct NormalEquations {
  Eigen::MatrixXd hessian;   ///< A^T R^-1 A, lower half
  Eigen::VectorXd gradient;  ///< A^T R^-1 g
  double norm = 0.0;         ///< g^T R^-1 g
};

/// What the pictures of one channel say about the coordinates y of two priors, log kappa's and then
/// log sigma_a's, on a coarser grid (reconstruct/posterior.h). What belongs to the shapes E of the
/// model's discrepancy (reconstruct/discrepancy.h) is kept apart, so that any eps is had without
/// another solve; for what is each picture's own, with variance v, E^T E = V Lambda V^T and B = A^T E V,
///
///   A^T R^-1 A = A^T A - B (1/v + Lambda)^-1 B^T
///
/// and what all pictures share is taken out after that in the same way.
class Information {
 public:
  Information(const ChannelProblem& problem,
              diffusion::FluenceSolver& solver,
              const PosteriorOptions& options);

  Result<void> gather(const ChannelCoefficients& estimate, std::stop_token stop);

  const Block& grid() const { return grid_; }
  const CosinePrior& diffusion() const { return diffusion_; }
  const CosinePrior& absorption() const { return absorption_; }
  Eigen::Index size() const { return diffusion_.size() + absorption_.size(); }
  NormalEquations normal_equations(double discrepancy) const;  ///< eps >= 0
  long solves() const { return solves_; }

 private:
  struct Discrepancy {         // of one picture
    Eigen::MatrixXd rows;      // B
    Eigen::VectorXd residual;  // V^T E^T g
    Eigen::VectorXd strength;  // Lambda
    Eigen::MatrixXd turn;      // V
  };
  struct Point;  // of linearisation
  Result<ChannelProblem> coarse_misfit(const ChannelCoefficients& estimate, std::stop_token stop);
  Result<void> solve_all(Point& at, std::stop_token stop);
  Result<diffusion::FieldBatch> solve(const diffusion::FieldBatch& b, std::stop_token stop);
  void add_rows(const Point& at, std::size_t illumination, NormalEquations& sums);
  void add_all_rows(const Point& at, std::stop_token stop);

  const ChannelProblem& fine_;
  diffusion::FluenceSolver& solver_;
  const PosteriorOptions& options_;
  Block grid_;
  CosinePrior diffusion_;
  CosinePrior absorption_;
  DiscrepancyShapes shapes_;
  NormalEquations sums_;  // at eps = 0
  std::vector<Discrepancy> discrepancies_;
  long solves_ = 0;
};

}  // namespace opaline::reconstruct
