#include "capture/steadiness.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace opaline::capture {
namespace {

constexpr double kLight = 0.01;
constexpr double kInPart = 0.03;
constexpr double kLevels = 0.03;
constexpr double kInOnePlace = 2.0;   // times what a shift changes: no shift
constexpr double kKnown = 0.25;       // of what exposures are known to disagree by
constexpr double kCurve = 3.0;        // times as much, through a response curve
constexpr double kBlackError = 0.03;  // codes that black is told to, and what rounding adds
constexpr double kCurveError = 0.01;  // of full scale
constexpr double kDeviations = 5.0;   // of one figure
constexpr double kTrend = 0.95;       // of the variance, on a line over time
constexpr double kSteps = 0.7;        // of the range, the largest of many steps in one direction
constexpr std::size_t kTakes = 3;

double logarithm(double light) { return std::log1p(std::max(light, -0.9)); }

// Codes are whole: a mean of them is off by up to exp(-2 pi^2 s^2) / pi codes where noise of s codes is all that varies (Widrow and
// Kollar 2008, Sec. 4). Of full scale.
double code_error(const CameraCalibration& camera) {
  if (camera.response.kind != ResponseCurve::Kind::kLinear) return kCurveError;
  const double noise = camera.read_noise_electrons / camera.gain_electrons_per_code;
  const double rounding =
      std::exp(-2.0 * std::numbers::pi * std::numbers::pi * noise * noise) / std::numbers::pi;
  return (kBlackError + rounding) / (camera.max_code() - camera.black_level);
}

std::string between(const TimedExposure& a, const TimedExposure& b) {
  return fmt::format(
      "between exposures of {:.4g} s and {:.4g} s", a.pair.light_seconds, b.pair.light_seconds);
}

/// Whether light has grown or fallen all the time, not in one step only; `values` by time.
bool is_trend(const std::vector<std::pair<double, double>>& values) {
  if (values.size() < 3) return false;
  const auto n = static_cast<double>(values.size());
  double t0 = 0.0;
  double v0 = 0.0;
  for (const auto& [t, v] : values) {
    t0 += t / n;
    v0 += v / n;
  }
  double tt = 0.0;
  double tv = 0.0;
  double vv = 0.0;
  for (const auto& [t, v] : values) {
    tt += (t - t0) * (t - t0);
    tv += (t - t0) * (v - v0);
    vv += (v - v0) * (v - v0);
  }
  if (tv * tv > kTrend * tt * vv) return true;
  const double range = std::abs(values.back().second - values.front().second);
  double path = 0.0;
  double largest = 0.0;
  for (std::size_t i = 0; i + 1 < values.size(); ++i) {
    const double step = std::abs(values[i + 1].second - values[i].second);
    path += step;
    largest = std::max(largest, step);
  }
  return kTrend * path < range && largest < kSteps * range;
}

}  // namespace

std::string_view to_string(Unsteadiness kind) {
  switch (kind) {
    case Unsteadiness::kMotion:
      return "motion";
    case Unsteadiness::kFlicker:
      return "flicker";
    case Unsteadiness::kDrift:
      return "drift";
    case Unsteadiness::kLevels:
      return "levels";
  }
  return "";
}

/// Exposures from the shortest to the longest, and what each shows against the next.
struct SteadinessCheck::Chain {
  std::vector<TimedExposure> exposures;
  std::vector<std::optional<ExposureComparison>> steps;  ///< one less
  double inverse_signal = 0.0;                           ///< most of any step
};

SteadinessCheck::SteadinessCheck(const CameraCalibration& camera)
    : comparer_(camera),
      scale_(camera.response.kind == ResponseCurve::Kind::kLinear ? 1.0 : kCurve),
      code_error_(code_error(camera)) {}

SteadinessCheck::Chain SteadinessCheck::chain_of(std::span<const TimedExposure> exposures,
                                                 const Image<std::uint8_t>& footprint) const {
  Chain chain{{exposures.begin(), exposures.end()}, {}, 0.0};
  std::ranges::stable_sort(
      chain.exposures, {}, [](const TimedExposure& e) { return e.pair.light_seconds; });
  for (std::size_t i = 0; i + 1 < chain.exposures.size(); ++i) {
    chain.steps.push_back(
        comparer_.compare(chain.exposures[i].pair, chain.exposures[i + 1].pair, footprint));
    if (chain.steps.back())
      chain.inverse_signal = std::max(chain.inverse_signal, chain.steps.back()->inverse_signal);
  }
  return chain;
}

const SteadinessCheck::Part* SteadinessCheck::worst_of(const ExposureComparison& step) const {
  const Part* worst = nullptr;
  for (const Part& part : step.parts) {
    const double limit = scale_ * kInPart + 2.0 * code_error_ * part.inverse_signal;
    const double size = std::abs(part.light.value);
    if (size > limit && (worst == nullptr || size > std::abs(worst->light.value))) worst = &part;
  }
  return worst;
}

std::optional<UnsteadyLight> SteadinessCheck::motion_in(const Chain& chain, double limit) const {
  for (std::size_t i = 0; i < chain.steps.size(); ++i) {
    if (!chain.steps[i]) continue;
    const ExposureComparison& step = *chain.steps[i];
    const std::string when = between(chain.exposures[i], chain.exposures[i + 1]);
    const bool moved = step.shift.exceeds(limit, kDeviations);
    const Part* part = worst_of(step);
    if (part != nullptr && (!moved || std::abs(part->light.value) > kInOnePlace * step.shift.value))
      return UnsteadyLight{Unsteadiness::kMotion,
                           std::abs(part->light.value),
                           part->light.deviation,
                           moved ? step.shift_px : 0.0,
                           std::pair(part->x, part->y),
                           fmt::format("motion: around pixel ({}, {}) light differs by {:.2g} % {}",
                                       part->x,
                                       part->y,
                                       100.0 * std::abs(part->light.value),
                                       when)};
    if (moved)
      return UnsteadyLight{
          Unsteadiness::kMotion,
          step.shift.value,
          step.shift.deviation,
          step.shift_px,
          std::nullopt,
          fmt::format("motion: the picture moved by {:.2g} px {}, which changes light by {:.2g} %",
                      step.shift_px,
                      when,
                      100.0 * step.shift.value)};
  }
  return std::nullopt;
}

std::array<double, 4> SteadinessCheck::known(const TimedExposure& a, const TimedExposure& b) const {
  const auto found = known_.find({a.exposure_index, b.exposure_index});
  return found == known_.end() ? std::array<double, 4>{} : found->second;
}

/// Exposures that can be compared one with the next: logarithm of the light of each, and its variance, since the first.
struct SteadinessCheck::Run {
  std::vector<double> values{0.0};
  std::vector<double> variances{0.0};
  double known = 0.0;  // most of what was taken away as known

  std::optional<UnsteadyLight> unsteady(const Chain& chain, std::size_t first, double limit) const {
    const auto [low, high] = std::ranges::minmax_element(values);
    const auto l = static_cast<std::size_t>(low - values.begin());
    const auto h = static_cast<std::size_t>(high - values.begin());
    const ExposureComparison::Figure range{*high - *low,
                                           std::sqrt(std::abs(variances[h] - variances[l]))};
    if (!range.exceeds(limit + kKnown * known, kDeviations)) return std::nullopt;
    std::vector<std::pair<double, double>> by_time;
    for (std::size_t i = 0; i < values.size(); ++i)
      by_time.emplace_back(chain.exposures[first + i].middle_s, values[i]);
    std::ranges::sort(by_time);
    const bool falls = by_time.back().second < by_time.front().second;
    const auto [a, b] = std::minmax(l, h);
    const bool drifts = is_trend(by_time);
    return UnsteadyLight{
        drifts ? Unsteadiness::kDrift : Unsteadiness::kFlicker,
        range.value,
        range.deviation,
        0.0,
        std::nullopt,
        drifts ? fmt::format("drift: light {} by {:.2g} % over {} exposures",
                             falls ? "fell" : "grew",
                             100.0 * range.value,
                             values.size())
               : fmt::format("flicker: light differs by {:.2g} % {}",
                             100.0 * range.value,
                             between(chain.exposures[first + a], chain.exposures[first + b]))};
  }
};

SteadinessCheck::Run SteadinessCheck::run_from(const Chain& chain,
                                               std::size_t first,
                                               std::size_t channel) const {
  Run run;
  for (std::size_t i = first; i < chain.steps.size(); ++i) {
    if (!chain.steps[i] || !chain.steps[i]->light[channel]) break;
    const auto& [value, deviation] = *chain.steps[i]->light[channel];
    const double before = known(chain.exposures[i], chain.exposures[i + 1])[channel];
    run.values.push_back(run.values.back() - logarithm(value) + before);
    run.known = std::max(run.known, std::abs(before));
    run.variances.push_back(run.variances.back() + deviation * deviation);
  }
  return run;
}

std::optional<UnsteadyLight> SteadinessCheck::light_in(const Chain& chain, double limit) const {
  std::optional<UnsteadyLight> worst;
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t first = 0; first < chain.exposures.size();) {
      const Run run = run_from(chain, first, c);
      if (const auto found = run.unsteady(chain, first, limit);
          found && (!worst || found->size > worst->size))
        worst = found;
      first += run.values.size();
    }
  }
  return worst;
}

std::optional<UnsteadyLight> SteadinessCheck::levels_in(const Chain& chain, double limit) const {
  for (std::size_t i = 0; i < chain.steps.size(); ++i) {
    if (!chain.steps[i]) continue;
    ExposureComparison::Figure levels = chain.steps[i]->levels;
    levels.value -= known(chain.exposures[i], chain.exposures[i + 1])[3];
    if (!levels.exceeds(limit, kDeviations)) continue;
    return UnsteadyLight{Unsteadiness::kLevels,
                         std::abs(levels.value),
                         levels.deviation,
                         0.0,
                         std::nullopt,
                         fmt::format("levels: bright and dark parts disagree by {:.2g} % {}",
                                     100.0 * std::abs(levels.value),
                                     between(chain.exposures[i], chain.exposures[i + 1]))};
  }
  return std::nullopt;
}

bool SteadinessCheck::same_each_time(double limit) const {
  if (takes_.size() < kTakes) return false;
  for (std::size_t t = takes_.size() - kTakes; t + 1 < takes_.size(); ++t) {
    if (takes_[t].size() != takes_.back().size()) return false;
    for (const auto& [exposures, figures] : takes_.back()) {
      const auto found = takes_[t].find(exposures);
      if (found == takes_[t].end()) return false;
      for (std::size_t c = 0; c < figures.size(); ++c)
        if (std::abs(found->second[c] - figures[c]) > limit) return false;
    }
  }
  return true;
}

double SteadinessCheck::light_limit(const Chain& chain) const {
  return scale_ * kLight + 2.0 * code_error_ * chain.inverse_signal;
}

std::optional<UnsteadyLight> SteadinessCheck::moved(const TimedExposure& before,
                                                    const TimedExposure& now,
                                                    const Image<std::uint8_t>& footprint) const {
  const Chain chain = chain_of(std::array{before, now}, footprint);
  return motion_in(chain, light_limit(chain));
}

SteadinessCheck::Verdict SteadinessCheck::judge(std::span<const TimedExposure> exposures,
                                                const Image<std::uint8_t>& footprint) {
  const Chain chain = chain_of(exposures, footprint);
  const double limit = light_limit(chain);
  Verdict verdict{motion_in(chain, limit), {}};
  if (verdict.unsteady) {
    takes_.clear();
    return verdict;
  }
  verdict.unsteady = light_in(chain, limit);
  if (!verdict.unsteady) verdict.unsteady = levels_in(chain, limit / kLight * kLevels);
  if (!verdict.unsteady) return verdict;
  Signature signature;
  for (std::size_t i = 0; i < chain.steps.size(); ++i) {
    const std::pair key{chain.exposures[i].exposure_index, chain.exposures[i + 1].exposure_index};
    if (!chain.steps[i] || key.first == key.second) continue;
    const ExposureComparison& step = *chain.steps[i];
    const auto light = [&](std::size_t c) {
      return step.light[c] ? logarithm(step.light[c]->value) : 0.0;
    };
    signature[key] = {light(0), light(1), light(2), step.levels.value};
  }
  takes_.push_back(std::move(signature));
  if (!same_each_time(0.5 * limit)) return verdict;
  for (const auto& [key, figures] : takes_.back()) known_[key] = figures;
  verdict.disagreement = fmt::format(
      "{}, the same each time: exposure times or the camera's response are not what the "
      "calibration says; calibrate the station",
      verdict.unsteady->message);
  verdict.unsteady =
      light_in(chain, limit);  // exposures that were repeated are to agree all the same
  if (verdict.unsteady) verdict.disagreement.clear();
  return verdict;
}

}  // namespace opaline::capture
