#include "calibration/lens_fit.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "calibration/kept_views.h"
#include "calibration/zhang.h"

namespace opaline::calibration {
namespace {

constexpr int kRounds = 10;
constexpr std::array<std::size_t, 3> kRadial{0, 1, 4};  // of the distortion: k1 k2 k3
constexpr double kTold = 2.0;                           // standard deviations
constexpr int kFieldsX = 8;
constexpr int kFieldsY = 6;

double coverage_of(const Bundle& bundle) {
  const CameraModel& lens = bundle.lenses.front();
  std::vector<bool> seen(static_cast<std::size_t>(kFieldsX) * kFieldsY, false);
  for (const Sighting& s : bundle.sightings) {
    const int x = std::clamp(static_cast<int>(s.pixel.x / lens.width * kFieldsX), 0, kFieldsX - 1);
    const int y = std::clamp(static_cast<int>(s.pixel.y / lens.height * kFieldsY), 0, kFieldsY - 1);
    seen[static_cast<std::size_t>(y) * kFieldsX + static_cast<std::size_t>(x)] = true;
  }
  return static_cast<double>(std::ranges::count(seen, true)) / static_cast<double>(seen.size());
}

void begin(
    LensFit& fit, int width, int height, const Board& board, std::span<const BoardView> views) {
  std::vector<Homography> planes;
  std::vector<std::size_t> of;
  for (std::size_t v = 0; v < views.size(); ++v) {
    if (!fit.views[v].kept()) continue;
    const auto plane = board_homography(board, views[v]);
    if (plane) {
      planes.push_back(*plane);
      of.push_back(v);
    } else {
      fit.views[v].reason = "its corners lie on a line";
    }
  }
  fit.lens = initial_lens(width, height, planes);
  for (std::size_t i = 0; i < planes.size(); ++i)
    fit.views[of[i]].camera_from_board = initial_pose(fit.lens, planes[i]);
}

void take_over(LensFit& fit, const Kept& kept, const std::vector<double>& rms_px) {
  fit.lens = kept.bundle.lenses.front();
  for (std::size_t v = 0; v < kept.view.size(); ++v) {
    ViewFit& view = fit.views[kept.view[v]];
    view.camera_from_board = kept.bundle.camera_from_board[v];
    view.rms_px = rms_px[v];
  }
}

void conclude(LensFit& fit, const Kept& kept, const BundleSummary& summary) {
  take_over(fit, kept, summary.view_rms_px.front());
  const LensDeviation free = fit.deviation;
  fit.deviation = summary.deviation.front();
  keep_held(fit.deviation, fit.radial_terms, free);
  fit.rms_px = summary.rms_px.front();
  fit.worst_view_px = std::ranges::max(summary.view_rms_px.front());
  fit.median_view_px = median_of(summary.view_rms_px.front());
  fit.coverage = coverage_of(kept.bundle);
  fit.corners = static_cast<int>(kept.bundle.sightings.size());
}

// Whether the highest radial term cannot be told from 0: then it is 0 from now on.
bool hold_untold_term(LensFit& fit, Bundle& bundle, const BundleSummary& summary) {
  if (fit.radial_terms < 2) return false;
  const auto last = static_cast<std::size_t>(fit.radial_terms - 1);
  double& term = bundle.lenses.front().distortion[kRadial[last]];
  const double deviation = summary.deviation.front()[4 + kRadial[last]];
  if (std::abs(term) >= kTold * deviation) return false;
  term = 0.0;
  fit.deviation[4 + kRadial[last]] = deviation;
  bundle.radial_terms = {--fit.radial_terms};
  return true;
}

}  // namespace

int LensFit::kept() const { return count_kept(views); }

void keep_held(LensDeviation& deviation, int radial_terms, const LensDeviation& free) {
  for (auto i = static_cast<std::size_t>(radial_terms); i < kRadial.size(); ++i)
    deviation[4 + kRadial[i]] = free[4 + kRadial[i]];
}

Result<LensFit> fit_lens(int width,
                         int height,
                         const Board& board,
                         std::span<const BoardView> views,
                         const LensFitOptions& options,
                         std::stop_token stop) {
  LensFit fit;
  fit.views = looked_at(views, options);
  begin(fit, width, height, board, views);
  auto counts = all_count(views);
  for (int round = 0; round < kRounds; ++round) {
    if (auto done = enough(fit.views, options.fewest_views); !done) return done.error();
    Kept kept = kept_of(fit.lens, board, views, fit.views, counts);
    const auto robust = adjust_robustly(kept.bundle, stop);
    if (!robust) return robust.error();
    take_over(fit, kept, typical_rms(kept, *robust, 0));
    if (leave_out(fit.views, options, "does not fit")) continue;
    fit.outliers = drop_outliers(kept, *robust, 0, options.outlier, counts);
    break;
  }
  Kept kept = kept_of(fit.lens, board, views, fit.views, counts);
  auto last = adjust(kept.bundle, {}, stop);
  while (last && hold_untold_term(fit, kept.bundle, *last)) last = adjust(kept.bundle, {}, stop);
  if (!last) return last.error();
  conclude(fit, kept, *last);
  return fit;
}

}  // namespace opaline::calibration
