#pragma once

#include <Eigen/Core>
#include <stop_token>
#include <vector>

#include "base/result.h"
#include "reconstruct/channel_problem.h"
#include "reconstruct/diffusion/fluence_solver.h"
#include "reconstruct/posterior.h"
#include "reconstruct/prior.h"

namespace opaline::reconstruct {

/// What the pictures of one channel say about the coordinates of two priors, log kappa's and then
/// log sigma_a's, on a coarser grid: A^T A, A^T g and |g|^2 (reconstruct/posterior.h).
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
  const Eigen::MatrixXd& hessian() const { return sums_.hessian; }    ///< A^T A, lower half
  const Eigen::VectorXd& gradient() const { return sums_.gradient; }  ///< A^T g
  double norm() const { return sums_.norm; }                          ///< |g|^2
  long solves() const { return solves_; }

 private:
  struct Sums {
    Eigen::MatrixXd hessian;
    Eigen::VectorXd gradient;
    double norm = 0.0;
    void add(const Sums& other);
  };
  struct Point;  // of linearisation
  Result<ChannelProblem> coarse_misfit(const ChannelCoefficients& estimate, std::stop_token stop);
  Result<void> solve_all(Point& at, std::stop_token stop);
  Result<diffusion::FieldBatch> solve(const diffusion::FieldBatch& b, std::stop_token stop);
  void add_rows(const Point& at, std::size_t illumination, Sums& sums) const;
  void add_all_rows(const Point& at, std::stop_token stop);

  const ChannelProblem& fine_;
  diffusion::FluenceSolver& solver_;
  const PosteriorOptions& options_;
  Block grid_;
  CosinePrior diffusion_;
  CosinePrior absorption_;
  Sums sums_;
  long solves_ = 0;
};

}  // namespace opaline::reconstruct
