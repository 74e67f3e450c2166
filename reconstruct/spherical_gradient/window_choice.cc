#include "reconstruct/spherical_gradient/window_choice.h"

#include <algorithm>
#include <cmath>

namespace opaline::reconstruct {
namespace {

bool is_certain(const WindowValues& w, double flat, double certain) {
  const double beyond = w.ratio - flat;
  return w.count >= 6 && w.curvature > 0.0 && beyond > 0.0 &&
         w.curvature_variance < certain * certain * w.curvature * w.curvature &&
         w.ratio_variance < certain * certain * beyond * beyond;
}

/// A pixel's normal as its window says, a unit vector.
void put_normal(const WindowValues& w, std::size_t at, ScatteringMaps& maps) {
  const double across = w.normal_x * w.normal_x + w.normal_y * w.normal_y;
  if (!(across < 1.0)) return;
  maps.normal_x[at] = static_cast<float>(w.normal_x);
  maps.normal_y[at] = static_cast<float>(w.normal_y);
  maps.normal_z[at] = static_cast<float>(std::sqrt(1.0 - across));
}

bool is_concave(const WindowValues& w, double sure) {
  return w.count >= 6 && w.curvature < 0.0 &&
         w.curvature * w.curvature > sure * sure * w.curvature_variance;
}

/// Whether a larger window sees what the smaller one saw: where it does not, the object changes within it.
bool agrees(const WindowValues& larger, const WindowValues& smaller, double sigmas) {
  if (smaller.count < 6) return true;
  const double bend = larger.curvature - smaller.curvature;
  const double ratio = larger.ratio - smaller.ratio;
  const double square = sigmas * sigmas;
  return bend * bend <= square * smaller.curvature_variance &&
         ratio * ratio <= square * smaller.ratio_variance;
}

}  // namespace

FlatRatios::FlatRatios(const BallTable& table) {
  for (std::size_t n = 0; n < ratios_.size(); ++n)
    ratios_[n] = table.flat_ratio(static_cast<double>(n) / kSteps);
}

double FlatRatios::at(double reflectance) const {
  const double place = std::clamp(reflectance, 0.0, 1.0) * kSteps;
  const auto n = std::min(static_cast<std::size_t>(place), ratios_.size() - 2);
  const double part = place - static_cast<double>(n);
  return (1.0 - part) * ratios_[n] + part * ratios_[n + 1];
}

double sure_deviations(const PixelValues& values) {
  const auto count = std::ranges::count(values.measured, std::uint8_t{1});
  return std::sqrt(2.0 * std::log(std::max(10.0, static_cast<double>(count)))) + 0.5;
}

int WindowChooser::rows_of_band(const MapOptions& options) {
  return WindowRows::side_of(options.half_windows.back());
}

WindowChooser::WindowChooser(const PixelValues& values,
                             const FlatRatios& flat,
                             const MapOptions& options,
                             double sure,
                             int begin,
                             ScatteringMaps& maps)
    : values_(values), flat_(flat), options_(options), maps_(maps), sure_(sure), row_(begin) {
  for (const int half : options.half_windows) windows_.emplace_back(values, half, begin);
}

std::span<const WindowValues> WindowChooser::next() {
  const int end = std::min(values_.height, row_ + rows_of_band(options_));
  first_ = values_.index(0, row_);
  const std::size_t count = values_.index(0, end) - first_;
  chosen_.assign(count, {});
  state_.assign(count, 0);
  for (WindowRows& rows : windows_) look(rows, end);
  row_ = end;
  return chosen_;
}

void WindowChooser::look(WindowRows& rows, int end) {
  const auto wanted = [this](std::size_t at) { return state_[at - first_] != kBoth; };
  for (int top = row_; top < end; top += rows.side()) {
    rows.advance();
    rows.for_each(wanted, [this](int x, int y, const WindowValues& window) {
      choose(window, values_.index(x, y));
    });
  }
}

void WindowChooser::choose(const WindowValues& window, std::size_t at) {
  const double certain_of_normal = options_.normal_certain * options_.normal_certain;
  std::uint8_t& state = state_[at - first_];
  WindowValues& chosen = chosen_[at - first_];
  if ((state & kHasNormal) == 0 && window.count >= 6) {
    put_normal(window, at, maps_);
    if (window.normal_variance < certain_of_normal) state |= kHasNormal;
  }
  if ((state & kSettled) != 0) return;
  if (!agrees(window, chosen, options_.agree)) {
    state |= kSettled;
    return;
  }
  chosen = window;
  if (is_certain(window, flat_.at(window.reflectance), options_.certain) ||
      is_concave(window, sure_))
    state |= kSettled;
}

}  // namespace opaline::reconstruct
