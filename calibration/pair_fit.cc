#include "calibration/pair_fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "calibration/kept_views.h"
#include "calibration/pose_chain.h"

namespace opaline::calibration {
namespace {

constexpr int kPairRounds = 10;
constexpr double kDisagreeFloor = 0.03;  // px

Vec3 turn_of(const Pose& pose) {  // its axis times twice the sine of half its angle, roughly
  const auto& r = pose.rotation;
  return {r[7] - r[5], r[2] - r[6], r[3] - r[1]};
}

// The projector's place that is in the middle of what the views tell: one view's, so that it is a rigid motion.
Pose middle_place(const std::vector<Pose>& places) {
  double best = 0.0;
  Pose found;
  for (const Pose& candidate : places) {
    std::vector<double> away;
    away.reserve(places.size());
    for (const Pose& other : places) {
      away.push_back(length(candidate.translation - other.translation) +
                     length(candidate.translation) * length(turn_of(candidate) - turn_of(other)));
    }
    const double typical = median_of(away);
    if (&candidate == &places.front() || typical < best) {
      best = typical;
      found = candidate;
    }
  }
  return found;
}

void merge_reasons(PairFit& fit, std::span<const BoardView> camera_views) {
  for (std::size_t v = 0; v < camera_views.size(); ++v) {
    ViewFit view = fit.camera.views[v];
    if (view.kept() && !fit.projector.views[v].kept())
      view.reason = fmt::format("projector: {}", fit.projector.views[v].reason);
    fit.views.push_back(view);
  }
}

CameraModel placed_projector(const PairFit& fit) {
  std::vector<Pose> places;
  for (std::size_t v = 0; v < fit.views.size(); ++v) {
    if (!fit.views[v].kept()) continue;
    places.push_back(chained(fit.projector.views[v].camera_from_board,
                             fit.camera.views[v].camera_from_board.inverse()));
  }
  CameraModel projector = fit.projector.lens;
  projector.camera_from_sample = middle_place(places);
  return projector;
}

struct PairViews {
  std::span<const BoardView> camera;
  std::span<const BoardView> projector;
};

Kept kept_pair(const PairFit& fit,
               const Board& board,
               const PairViews& views,
               const std::array<Counts, 2>& counts) {
  Kept kept = kept_of(fit.joint_camera, board, views.camera, fit.views, counts[0]);
  kept.bundle.lenses.push_back(fit.joint_projector);
  kept.bundle.radial_terms = {fit.camera.radial_terms, fit.projector.radial_terms};
  add_sightings(kept, 1, board, views.projector, counts[1]);
  return kept;
}

void take_over_pair(PairFit& fit,
                    const Kept& kept,
                    const std::array<std::vector<double>, 2>& rms_px) {
  fit.joint_camera = kept.bundle.lenses[0];
  fit.joint_projector = kept.bundle.lenses[1];
  for (std::size_t v = 0; v < kept.view.size(); ++v) {
    ViewFit& view = fit.views[kept.view[v]];
    view.camera_from_board = kept.bundle.camera_from_board[v];
    view.rms_px = std::hypot(rms_px[0][v], rms_px[1][v]) / std::numbers::sqrt2;
  }
}

// Names the views that each lens alone can explain, and both together cannot; whether there are new ones.
bool leave_out_moved(PairFit& fit, const LensFitOptions& options) {
  bool any = false;
  for (std::size_t v = 0; v < fit.views.size(); ++v) {
    ViewFit& view = fit.views[v];
    const double alone =
        std::hypot(fit.camera.views[v].rms_px, fit.projector.views[v].rms_px) / std::numbers::sqrt2;
    if (!view.kept() || view.rms_px <= options.disagree * alone + kDisagreeFloor) continue;
    view.reason = fmt::format(
        "camera and projector disagree by {:.2f} px, each alone fits to {:.2f}: it moved before "
        "the patterns",
        view.rms_px,
        alone);
    any = true;
  }
  return any;
}

Result<void> fit_together(PairFit& fit,
                          const Board& board,
                          const PairViews& views,
                          const LensFitOptions& options,
                          const std::stop_token& stop) {
  std::array counts{all_count(views.camera), all_count(views.projector)};
  for (int round = 0; round < kPairRounds; ++round) {
    if (auto done = enough(fit.views, options.fewest_views); !done) return done;
    Kept kept = kept_pair(fit, board, views, counts);
    const auto robust = adjust_robustly(kept.bundle, stop);
    if (!robust) return robust.error();
    take_over_pair(fit, kept, {typical_rms(kept, *robust, 0), typical_rms(kept, *robust, 1)});
    if (leave_out_moved(fit, options) || leave_out(fit.views, options, "does not fit")) continue;
    for (const int lens : {0, 1}) {
      drop_outliers(kept, *robust, lens, options.outlier, counts[static_cast<std::size_t>(lens)]);
    }
    break;
  }
  Kept kept = kept_pair(fit, board, views, counts);
  BundleOptions how;
  how.sigma_px = {std::max(kLeastSigma, fit.camera.rms_px),
                  std::max(kLeastSigma, fit.projector.rms_px)};
  const auto last = adjust(kept.bundle, how, stop);
  if (!last) return last.error();
  take_over_pair(fit, kept, {last->view_rms_px[0], last->view_rms_px[1]});
  fit.deviation = {last->deviation[0], last->deviation[1]};
  keep_held(fit.deviation[0], fit.camera.radial_terms, fit.camera.deviation);
  keep_held(fit.deviation[1], fit.projector.radial_terms, fit.projector.deviation);
  fit.place_deviation = last->pose_deviation;
  fit.stereo_rms_px = last->all_rms_px;
  return ok();
}

// The middle of the shortest line between two rays.
Vec3 meeting(Vec3 p, Vec3 u, Vec3 q, Vec3 v) {
  const Vec3 w = p - q;
  const double b = dot(u, v);
  const double d = dot(u, w);
  const double e = dot(v, w);
  const double below = 1.0 - b * b;
  const Vec3 a = p + u * ((b * e - d) / below);
  const Vec3 c = q + v * ((e - b * d) / below);
  return (a + c) * 0.5;
}

std::optional<CameraModel::Pixel> seen_at(const BoardView& view, int id) {
  const auto found = std::ranges::find(view.corners, id, &BoardCorner::id);
  return found == view.corners.end() ? std::nullopt : std::optional(found->pixel);
}

std::optional<Vec3> point_of(const PairFit& fit,
                             const BoardView& camera,
                             const BoardView& projector,
                             int id) {
  const auto a = seen_at(camera, id);
  const auto b = seen_at(projector, id);
  if (!a || !b) return std::nullopt;
  return meeting({},
                 fit.joint_camera.ray_direction(*a),
                 fit.joint_projector.centre(),
                 fit.joint_projector.ray_direction(*b));
}

}  // namespace

int PairFit::kept() const { return count_kept(views); }

Result<PairFit> fit_pair(std::array<int, 2> camera_size,
                         std::array<int, 2> projector_size,
                         const Board& board,
                         std::span<const BoardView> camera_views,
                         std::span<const BoardView> projector_views,
                         const LensFitOptions& options,
                         std::stop_token stop) {
  if (camera_views.size() != projector_views.size())
    return invalid_argument("camera and projector saw different numbers of poses");
  PairFit fit;
  auto camera = fit_lens(camera_size[0], camera_size[1], board, camera_views, options, stop);
  if (!camera) return camera.error().in("camera");
  auto projector =
      fit_lens(projector_size[0], projector_size[1], board, projector_views, options, stop);
  if (!projector) return projector.error().in("projector");
  fit.camera = *std::move(camera);
  fit.projector = *std::move(projector);
  merge_reasons(fit, camera_views);
  if (auto done = enough(fit.views, options.fewest_views); !done) return done.error();
  fit.joint_camera = fit.camera.lens;
  fit.joint_projector = placed_projector(fit);
  const auto done = fit_together(fit, board, {camera_views, projector_views}, options, stop);
  if (!done) return done.error().in("camera and projector");
  std::vector<double> rms;
  for (const ViewFit& view : fit.views) {
    if (view.kept()) rms.push_back(view.rms_px);
  }
  fit.worst_view_px = std::ranges::max(rms);
  fit.median_view_px = median_of(rms);
  return fit;
}

std::vector<double> row_lengths(const PairFit& fit,
                                const Board& board,
                                std::span<const BoardView> camera_views,
                                std::span<const BoardView> projector_views) {
  std::vector<double> lengths;
  for (std::size_t v = 0; v < fit.views.size(); ++v) {
    if (!fit.views[v].kept()) continue;
    for (int row = 0; row < board.rows(); ++row) {
      const int first = row * board.columns();
      const auto a = point_of(fit, camera_views[v], projector_views[v], first);
      const auto b =
          point_of(fit, camera_views[v], projector_views[v], first + board.columns() - 1);
      if (a && b) lengths.push_back(length(*b - *a));
    }
  }
  return lengths;
}

}  // namespace opaline::calibration
