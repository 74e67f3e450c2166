#include "calibration/bundle_adjustment.h"

#include <ceres/ceres.h>
#include <ceres/rotation.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

namespace opaline::calibration {
namespace {

using LensBlock = std::array<double, 9>;
using PoseBlock = std::array<double, 6>;  // angle axis, then translation

template <class T>
void move(const T* pose, std::array<T, 3>& p) {
  std::array<T, 3> turned{};
  ceres::AngleAxisRotatePoint(pose, p.data(), turned.data());
  for (std::size_t i = 0; i < 3; ++i) p[i] = turned[i] + pose[3 + i];
}

// Written apart from CameraModel::project(), for automatic derivatives.
template <class T>
void look(const T* lens, const std::array<T, 3>& p, T* pixel) {
  const T x = p[0] / p[2];
  const T y = p[1] / p[2];
  const T r2 = x * x + y * y;
  const T c = 1.0 + r2 * (lens[4] + r2 * (lens[5] + r2 * lens[8]));
  const T u = x * c + 2.0 * lens[6] * x * y + lens[7] * (r2 + 2.0 * x * x);
  const T v = y * c + lens[6] * (r2 + 2.0 * y * y) + 2.0 * lens[7] * x * y;
  pixel[0] = lens[0] * u + lens[2];
  pixel[1] = lens[1] * v + lens[3];
}

struct Misses {
  Sighting seen;
  double sigma = 1.0;

  template <class T>
  bool fill(const T* lens, const std::array<T, 3>& p, T* residual) const {
    if (p[2] <= T(0.0)) return false;
    look(lens, p, residual);
    residual[0] = (residual[0] - seen.pixel.x) / sigma;
    residual[1] = (residual[1] - seen.pixel.y) / sigma;
    return true;
  }
  template <class T>
  bool operator()(const T* lens, const T* board, T* residual) const {
    std::array<T, 3> p{T(seen.x_mm), T(seen.y_mm), T(0.0)};
    move(board, p);
    return fill(lens, p, residual);
  }
  template <class T>
  bool operator()(const T* lens, const T* board, const T* place, T* residual) const {
    std::array<T, 3> p{T(seen.x_mm), T(seen.y_mm), T(0.0)};
    move(board, p);
    move(place, p);
    return fill(lens, p, residual);
  }
};

LensBlock block_of(const CameraModel& m) {
  const auto& d = m.distortion;
  return {m.fx, m.fy, m.cx, m.cy, d[0], d[1], d[2], d[3], d[4]};
}

void read_lens(const LensBlock& block, CameraModel& m) {
  m.fx = block[0];
  m.fy = block[1];
  m.cx = block[2];
  m.cy = block[3];
  std::copy_n(block.begin() + 4, 5, m.distortion.begin());
}

PoseBlock block_of(const Pose& pose) {
  PoseBlock block{};
  ceres::RotationMatrixToAngleAxis(ceres::RowMajorAdapter3x3(pose.rotation.data()), block.data());
  block[3] = pose.translation.x;
  block[4] = pose.translation.y;
  block[5] = pose.translation.z;
  return block;
}

Pose pose_of(const PoseBlock& block) {
  Pose pose;
  ceres::AngleAxisToRotationMatrix(block.data(), ceres::RowMajorAdapter3x3(pose.rotation.data()));
  pose.translation = {block[3], block[4], block[5]};
  return pose;
}

class StopWhenAsked : public ceres::IterationCallback {
 public:
  explicit StopWhenAsked(std::stop_token stop) : stop_(std::move(stop)) {}
  ceres::CallbackReturnType operator()(const ceres::IterationSummary& /*step*/) override {
    return stop_.stop_requested() ? ceres::SOLVER_ABORT : ceres::SOLVER_CONTINUE;
  }

 private:
  std::stop_token stop_;
};

struct Blocks {
  std::vector<LensBlock> lenses;
  std::vector<PoseBlock> places;  // of the lenses
  std::vector<PoseBlock> boards;
};

Blocks blocks_of(const Bundle& bundle) {
  Blocks blocks;
  for (const CameraModel& lens : bundle.lenses) {
    blocks.lenses.push_back(block_of(lens));
    blocks.places.push_back(block_of(lens.camera_from_sample));
  }
  for (const Pose& pose : bundle.camera_from_board) blocks.boards.push_back(block_of(pose));
  return blocks;
}

void read(const Blocks& blocks, Bundle& bundle) {
  for (std::size_t i = 0; i < bundle.lenses.size(); ++i) {
    read_lens(blocks.lenses[i], bundle.lenses[i]);
    if (i > 0) bundle.lenses[i].camera_from_sample = pose_of(blocks.places[i]);
  }
  for (std::size_t i = 0; i < bundle.camera_from_board.size(); ++i)
    bundle.camera_from_board[i] = pose_of(blocks.boards[i]);
}

double sigma_of(const BundleOptions& options, int lens) {
  return options.sigma_px.empty() ? 1.0 : options.sigma_px[static_cast<std::size_t>(lens)];
}

void build(ceres::Problem& problem,
           Blocks& blocks,
           const Bundle& bundle,
           const BundleOptions& options) {
  for (const Sighting& s : bundle.sightings) {
    ceres::LossFunction* const loss =
        options.huber > 0.0 ? new ceres::HuberLoss(options.huber) : nullptr;
    auto* const misses = new Misses{s, sigma_of(options, s.lens)};
    double* const lens = blocks.lenses[static_cast<std::size_t>(s.lens)].data();
    double* const board = blocks.boards[static_cast<std::size_t>(s.view)].data();
    if (s.lens == 0) {
      problem.AddResidualBlock(
          new ceres::AutoDiffCostFunction<Misses, 2, 9, 6>(misses), loss, lens, board);
    } else {
      problem.AddResidualBlock(new ceres::AutoDiffCostFunction<Misses, 2, 9, 6, 6>(misses),
                               loss,
                               lens,
                               board,
                               blocks.places[static_cast<std::size_t>(s.lens)].data());
    }
  }
}

// Terms of the radial distortion that stay as they are.
void hold_terms(ceres::Problem& problem, Blocks& blocks, const Bundle& bundle) {
  constexpr std::array<int, 3> kRadial{4, 5, 8};
  for (std::size_t i = 0; i < bundle.radial_terms.size(); ++i) {
    const auto adjusted = static_cast<std::size_t>(bundle.radial_terms[i]);
    if (adjusted >= kRadial.size()) continue;
    const std::vector<int> held(kRadial.begin() + static_cast<std::ptrdiff_t>(adjusted),
                                kRadial.end());
    problem.SetManifold(blocks.lenses[i].data(), new ceres::SubsetManifold(9, held));
  }
}

int unknowns_of(const ceres::Problem& problem) {
  std::vector<double*> blocks;
  problem.GetParameterBlocks(&blocks);
  int sum = 0;
  for (const double* const block : blocks) sum += problem.ParameterBlockTangentSize(block);
  return sum;
}

Result<void> check_bundle(const Bundle& bundle) {
  std::vector<int> seen(bundle.camera_from_board.size(), 0);
  for (const Sighting& s : bundle.sightings) {
    if (s.lens < 0 || s.lens >= static_cast<int>(bundle.lenses.size()) || s.view < 0 ||
        s.view >= static_cast<int>(seen.size()))
      return invalid_argument("a sighting of a lens or view that there is not");
    ++seen[static_cast<std::size_t>(s.view)];
  }
  if (std::ranges::any_of(seen, [](int count) { return count < 4; }))
    return invalid_argument("a view with fewer than four corners");
  const std::size_t unknowns = 15 * bundle.lenses.size() - 6 + 6 * seen.size();
  if (2 * bundle.sightings.size() <= unknowns)
    return invalid_argument(fmt::format(
        "{} corners for {} unknowns: more views are needed", bundle.sightings.size(), unknowns));
  return ok();
}

double distance_of(const Bundle& bundle, const Sighting& s) {
  CameraModel lens = bundle.lenses[static_cast<std::size_t>(s.lens)];
  const Vec3 seen =
      bundle.camera_from_board[static_cast<std::size_t>(s.view)].apply({s.x_mm, s.y_mm, 0.0});
  if (s.lens == 0) lens.camera_from_sample = {};
  const CameraModel::Pixel p = lens.project(seen);
  return std::hypot(p.x - s.pixel.x, p.y - s.pixel.y);
}

void sum_up(const Bundle& bundle, BundleSummary& summary) {
  const std::size_t views = bundle.camera_from_board.size();
  std::vector<std::vector<double>> squares(bundle.lenses.size(), std::vector<double>(views, 0.0));
  std::vector<std::vector<double>> counts = squares;
  for (const Sighting& s : bundle.sightings) {
    const double d = distance_of(bundle, s);
    summary.distance_px.push_back(d);
    squares[static_cast<std::size_t>(s.lens)][static_cast<std::size_t>(s.view)] += d * d;
    counts[static_cast<std::size_t>(s.lens)][static_cast<std::size_t>(s.view)] += 1.0;
  }
  double all = 0.0;
  for (std::size_t k = 0; k < squares.size(); ++k) {
    double sum = 0.0;
    double count = 0.0;
    summary.view_rms_px.emplace_back(views, 0.0);
    for (std::size_t v = 0; v < views; ++v) {
      sum += squares[k][v];
      count += counts[k][v];
      if (counts[k][v] > 0.0) summary.view_rms_px[k][v] = std::sqrt(squares[k][v] / counts[k][v]);
    }
    all += sum;
    summary.rms_px.push_back(count > 0.0 ? std::sqrt(sum / count) : 0.0);
  }
  summary.all_rms_px = std::sqrt(all / static_cast<double>(bundle.sightings.size()));
}

template <std::size_t N>
std::array<double, N> deviations(const ceres::Covariance& covariance,
                                 const double* block,
                                 double variance) {
  std::array<double, N * N> matrix{};
  covariance.GetCovarianceBlock(block, block, matrix.data());
  std::array<double, N> out{};
  for (std::size_t i = 0; i < N; ++i)
    out[i] = std::sqrt(std::max(0.0, matrix[i * N + i] * variance));
  return out;
}

Result<void> fill_deviations(ceres::Problem& problem,
                             const Blocks& blocks,
                             const Bundle& bundle,
                             const BundleOptions& options,
                             BundleSummary& summary) {
  ceres::Covariance::Options how;
  how.sparse_linear_algebra_library_type = ceres::EIGEN_SPARSE;
  how.apply_loss_function = false;
  ceres::Covariance covariance(how);
  std::vector<const double*> wanted;
  for (const LensBlock& lens : blocks.lenses) wanted.push_back(lens.data());
  if (blocks.places.size() > 1) wanted.push_back(blocks.places[1].data());
  std::vector<std::pair<const double*, const double*>> pairs;
  pairs.reserve(wanted.size());
  for (const double* block : wanted) pairs.emplace_back(block, block);
  if (!covariance.Compute(pairs, &problem))
    return invalid_argument(
        "the views do not determine the lens: tilt the board, and show it in all parts of the "
        "picture");
  double squares = 0.0;
  for (std::size_t i = 0; i < bundle.sightings.size(); ++i) {
    const double d = summary.distance_px[i] / sigma_of(options, bundle.sightings[i].lens);
    squares += d * d;
  }
  const auto unknowns = static_cast<double>(unknowns_of(problem));
  const double variance =
      squares / std::max(1.0, 2.0 * static_cast<double>(bundle.sightings.size()) - unknowns);
  for (const LensBlock& lens : blocks.lenses)
    summary.deviation.push_back(deviations<9>(covariance, lens.data(), variance));
  if (blocks.places.size() > 1)
    summary.pose_deviation = deviations<6>(covariance, blocks.places[1].data(), variance);
  return ok();
}

}  // namespace

Result<BundleSummary> adjust(Bundle& bundle, const BundleOptions& options, std::stop_token stop) {
  if (auto good = check_bundle(bundle); !good) return good.error();
  Blocks blocks = blocks_of(bundle);
  ceres::Problem problem;
  build(problem, blocks, bundle, options);
  hold_terms(problem, blocks, bundle);
  ceres::Solver::Options how;
  how.linear_solver_type = ceres::DENSE_SCHUR;
  how.max_num_iterations = options.most_steps;
  how.function_tolerance = 1e-14;
  how.gradient_tolerance = 1e-14;
  how.parameter_tolerance = 1e-12;
  how.logging_type = ceres::SILENT;
  how.linear_solver_ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  for (PoseBlock& board : blocks.boards)
    how.linear_solver_ordering->AddElementToGroup(board.data(), 0);
  for (LensBlock& lens : blocks.lenses)
    how.linear_solver_ordering->AddElementToGroup(lens.data(), 1);
  for (std::size_t i = 1; i < blocks.places.size(); ++i)
    how.linear_solver_ordering->AddElementToGroup(blocks.places[i].data(), 1);
  StopWhenAsked asked(stop);
  how.callbacks.push_back(&asked);
  ceres::Solver::Summary solved;
  ceres::Solve(how, &problem, &solved);
  if (stop.stop_requested()) return cancelled("bundle adjustment: stopped");
  if (!solved.IsSolutionUsable())
    return invalid_argument(fmt::format("bundle adjustment: {}", solved.message));
  read(blocks, bundle);
  BundleSummary summary;
  summary.steps = static_cast<int>(solved.iterations.size());
  sum_up(bundle, summary);
  if (options.want_covariance) {
    if (auto done = fill_deviations(problem, blocks, bundle, options, summary); !done)
      return done.error();
  }
  return summary;
}

}  // namespace opaline::calibration
