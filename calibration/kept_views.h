#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "calibration/lens_fit.h"

/// What fit_lens() and fit_pair() share: which views and corners count.
namespace opaline::calibration {

constexpr double kLeastSigma = 1e-6;  ///< px; of corners without any noise

/// The bundle of the kept views, and which is which.
struct Kept {
  Bundle bundle;
  std::vector<std::size_t> view;                   ///< of the bundle's views
  std::vector<std::array<std::size_t, 2>> corner;  ///< of each sighting: its view and corner
};

using Counts = std::vector<std::vector<bool>>;  ///< whether a view's corner does

/// The upper one of an even number; 0 of none.
double median_of(std::vector<double> values);
/// Every view with why its picture will not do, if so.
std::vector<ViewFit> looked_at(std::span<const BoardView> views, const LensFitOptions& options);
/// Errors: kInvalidArgument when fewer than that are kept.
Result<void> enough(const std::vector<ViewFit>& views, int fewest);
int count_kept(const std::vector<ViewFit>& views);
Counts all_count(std::span<const BoardView> views);
void add_sightings(Kept& kept,
                   int lens,
                   const Board& board,
                   std::span<const BoardView> views,
                   const Counts& counts);
/// The kept views with a lens as it stands.
Kept kept_of(const CameraModel& lens,
             const Board& board,
             std::span<const BoardView> views,
             const std::vector<ViewFit>& fits,
             const Counts& counts);
/// Names the views that do not fit; whether there are new ones.
bool leave_out(std::vector<ViewFit>& views, const LensFitOptions& options, const char* what);
/// What the RMS of each of the bundle's views would be without the corners that are far off: from the median of their distances.
std::vector<double> typical_rms(const Kept& kept, const BundleSummary& summary, int lens);
/// Corners far off what the others of their view scatter, or of most views where that is more; how many.
int drop_outliers(
    const Kept& kept, const BundleSummary& summary, int lens, double outlier, Counts& counts);
/// With a scatter of 1 px, and again with the one that this leaves.
Result<BundleSummary> adjust_robustly(Bundle& bundle, std::stop_token stop);

}  // namespace opaline::calibration
