#include "calibration/kept_views.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <numbers>
#include <utility>

namespace opaline::calibration {
namespace {

constexpr double kHuberSigmas = 2.0;
constexpr double kBlurFloor = 0.3;            // px
constexpr double kWorstFloor = 0.05;          // px
constexpr double kMedianOfRayleigh = 1.1774;  // of a distance in the plane, in sigmas

}  // namespace

double median_of(std::vector<double> values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

std::vector<ViewFit> looked_at(std::span<const BoardView> views, const LensFitOptions& options) {
  std::vector<double> blurs;
  std::vector<double> contrasts;
  for (const BoardView& view : views) {
    if (!view.fault.empty() || view.contrast <= 0.0) continue;
    blurs.push_back(view.blur_px);
    contrasts.push_back(view.contrast);
  }
  const double blur = median_of(blurs);
  const double contrast = median_of(contrasts);
  std::vector<ViewFit> fits;
  for (const BoardView& view : views) {
    ViewFit fit;
    fit.name = view.name;
    fit.reason = view.fault;
    fit.corners = static_cast<int>(view.corners.size());
    fit.blur_px = view.blur_px;
    if (fit.kept() && view.blur_px > options.blurred * blur + kBlurFloor)
      fit.reason = fmt::format(
          "out of focus: its edges are {:.2f} px wide, most views' {:.2f}", view.blur_px, blur);
    if (fit.kept() && view.contrast < options.faint * contrast)
      fit.reason =
          fmt::format("faint: contrast of {:.0f}, most views' {:.0f}", view.contrast, contrast);
    fits.push_back(std::move(fit));
  }
  return fits;
}

Result<void> enough(const std::vector<ViewFit>& views, int fewest) {
  std::vector<std::string> left_out;
  int kept = 0;
  for (const ViewFit& view : views) {
    if (view.kept())
      ++kept;
    else
      left_out.push_back(fmt::format("{} ({})", view.name, view.reason));
  }
  if (kept >= fewest) return ok();
  return invalid_argument(fmt::format("{} of {} views can be used, {} are needed; left out: {}",
                                      kept,
                                      views.size(),
                                      fewest,
                                      fmt::join(left_out, ", ")));
}

void add_sightings(Kept& kept,
                   int lens,
                   const Board& board,
                   std::span<const BoardView> views,
                   const Counts& counts) {
  for (std::size_t v = 0; v < kept.view.size(); ++v) {
    const BoardView& view = views[kept.view[v]];
    for (std::size_t c = 0; c < view.corners.size(); ++c) {
      if (!counts[kept.view[v]][c]) continue;
      const Vec3 p = board.corner(view.corners[c].id);
      kept.bundle.sightings.push_back({lens, static_cast<int>(v), p.x, p.y, view.corners[c].pixel});
      kept.corner.push_back({kept.view[v], c});
    }
  }
}

Counts all_count(std::span<const BoardView> views) {
  Counts counts;
  for (const BoardView& view : views) counts.emplace_back(view.corners.size(), true);
  return counts;
}

bool leave_out(std::vector<ViewFit>& views, const LensFitOptions& options, const char* what) {
  std::vector<double> rms;
  for (const ViewFit& view : views) {
    if (view.kept()) rms.push_back(view.rms_px);
  }
  const double median = median_of(rms);
  bool any = false;
  for (ViewFit& view : views) {
    if (!view.kept() || view.rms_px <= options.worst_view * median + kWorstFloor) continue;
    view.reason = fmt::format("{}: {:.2f} px off, most views {:.2f}", what, view.rms_px, median);
    any = true;
  }
  return any;
}

std::vector<double> typical_rms(const Kept& kept, const BundleSummary& summary, int lens) {
  std::vector<std::vector<double>> distances(kept.view.size());
  for (std::size_t i = 0; i < summary.distance_px.size(); ++i) {
    const Sighting& s = kept.bundle.sightings[i];
    if (s.lens == lens)
      distances[static_cast<std::size_t>(s.view)].push_back(summary.distance_px[i]);
  }
  std::vector<double> rms;
  rms.reserve(distances.size());
  for (std::vector<double>& view : distances)
    rms.push_back(std::numbers::sqrt2 / kMedianOfRayleigh * median_of(std::move(view)));
  return rms;
}

int drop_outliers(
    const Kept& kept, const BundleSummary& summary, int lens, double outlier, Counts& counts) {
  if (outlier <= 0.0) return 0;
  const std::vector<double> of_views = typical_rms(kept, summary, lens);
  const double typical = median_of(of_views);
  int dropped = 0;
  for (std::size_t i = 0; i < summary.distance_px.size(); ++i) {
    const Sighting& s = kept.bundle.sightings[i];
    const double rms = std::max(typical, of_views[static_cast<std::size_t>(s.view)]);
    const double limit = outlier * std::max(kLeastSigma, rms / std::numbers::sqrt2);
    if (s.lens != lens || summary.distance_px[i] <= limit) continue;
    counts[kept.corner[i][0]][kept.corner[i][1]] = false;
    ++dropped;
  }
  return dropped;
}

Kept kept_of(const CameraModel& lens,
             const Board& board,
             std::span<const BoardView> views,
             const std::vector<ViewFit>& fits,
             const Counts& counts) {
  Kept kept;
  kept.bundle.lenses = {lens};
  for (std::size_t v = 0; v < views.size(); ++v) {
    if (!fits[v].kept()) continue;
    kept.view.push_back(v);
    kept.bundle.camera_from_board.push_back(fits[v].camera_from_board);
  }
  add_sightings(kept, 0, board, views, counts);
  return kept;
}

Result<BundleSummary> adjust_robustly(Bundle& bundle, std::stop_token stop) {
  BundleOptions how{.huber = 1.0, .sigma_px = {}, .want_covariance = false};
  how.sigma_px.assign(bundle.lenses.size(), 1.0);
  auto rough = adjust(bundle, how, stop);
  if (!rough) return rough;
  for (std::size_t k = 0; k < how.sigma_px.size(); ++k) {
    std::vector<double> distances;
    for (std::size_t i = 0; i < bundle.sightings.size(); ++i) {
      if (bundle.sightings[i].lens == static_cast<int>(k))
        distances.push_back(rough->distance_px[i]);
    }
    how.sigma_px[k] = std::max(kLeastSigma, median_of(distances) / kMedianOfRayleigh);
  }
  how.huber = kHuberSigmas;
  return adjust(bundle, how, stop);
}

int count_kept(const std::vector<ViewFit>& views) {
  return static_cast<int>(std::ranges::count_if(views, &ViewFit::kept));
}

}  // namespace opaline::calibration
