#include "reconstruct/spherical_gradient/window_answer.h"

#include <cmath>

namespace opaline::reconstruct {
namespace {

/// What interpolation in the table adds to ln D: balls of skin, wax, marble and stone, none of which is in it, have 0.0008 to 0.0076
/// (`bench led_sphere --part materials`).
constexpr double kTableDeviation = 0.01;
/// The tilt that a camera's slanted look makes, as a depth in mean free paths (tests/reconstruct/spherical_gradient/camera_tilt_test.cc).
constexpr double kTiltDepth = 1.0;
/// What else ln D is off by on shapes that are no balls: with it nine tenths and more of blob_a, blob_c and blob_d lie within two deviations
/// (`bench led_sphere --blobs`); chosen by blob_a.
constexpr double kShapeDeviation = 0.015;
/// What of the correction for two different principal curvatures is not known.
constexpr double kUnevenDeviation = 0.3;

LeftOut reason_of(BallTable::End end) {
  switch (end) {
    case BallTable::End::kFound:
      return LeftOut::kFound;
    case BallTable::End::kFlat:
      return LeftOut::kBelowNoise;
    case BallTable::End::kTooTranslucent:
      return LeftOut::kTooTranslucent;
    default:
      return LeftOut::kBeyondTable;
  }
}

/// Half of what the lowest and the highest index make of ln g, and of ln (g k l_d), which is ln D.
struct IndexSpread {
  double log_decay = 0.0;
  double log_diffusion = 0.0;
};
IndexSpread spread_of(const BallTable::Found& low, const BallTable::Found& high) {
  const double decay = 0.25 * std::log((1.0 - high.reduced_albedo) / (1.0 - low.reduced_albedo));
  return {decay, decay + 0.5 * std::log(high.curvature / low.curvature)};
}

}  // namespace

bool WindowAnswers::is_same(const WindowValues& w) const {
  return w.count == window_.count && w.curvature == window_.curvature &&
         w.curvature_variance == window_.curvature_variance && w.unevenness == window_.unevenness &&
         w.ratio == window_.ratio && w.ratio_variance == window_.ratio_variance &&
         w.reflectance == window_.reflectance &&
         w.reflectance_variance == window_.reflectance_variance;
}

/// Against the table's flat one.
double WindowAnswers::ratio_variance(const WindowValues& w) const {
  const double of_table = table_.ratio_deviation() * w.ratio;
  const double of_lamps = options_.shared.ratio * w.ratio;
  return w.ratio_variance + of_table * of_table + of_lamps * of_lamps;
}

double WindowAnswers::reflectance_variance(const WindowValues& w) const {
  const double shared = options_.shared.reflectance * w.reflectance;
  return w.reflectance_variance + shared * shared;
}

LeftOut WindowAnswers::judge(const WindowValues& w, double ratio_variance) const {
  if (w.count < 6) return LeftOut::kNotMeasured;
  const double deviation = std::sqrt(w.curvature_variance);
  if (w.curvature < -sure_ * deviation) return LeftOut::kConcave;
  if (w.curvature <= options_.sigmas * deviation) return LeftOut::kTooFlat;
  if (w.ratio - flat_.at(w.reflectance) <= options_.sigmas * std::sqrt(ratio_variance))
    return LeftOut::kBelowNoise;
  return LeftOut::kFound;
}

WindowAnswer WindowAnswers::answer(const WindowValues& w) {
  window_ = w;
  const double of_ratio = ratio_variance(w);
  WindowAnswer a;
  a.reason = judge(w, of_ratio);
  if (a.reason != LeftOut::kFound) return a;
  found_ = table_.find(w.reflectance, w.ratio, found_);
  a.reason = reason_of(found_.end);
  if (a.reason != LeftOut::kFound) return a;
  IndexSpread index;
  if (options_.lower_index != nullptr && options_.higher_index != nullptr) {
    lower_ = options_.lower_index->find(w.reflectance, w.ratio, lower_);
    higher_ = options_.higher_index->find(w.reflectance, w.ratio, higher_);
    for (const BallTable::Found* end : {&lower_, &higher_}) {
      a.reason = reason_of(end->end);
      if (a.reason != LeftOut::kFound) return a;
    }
    index = spread_of(lower_, higher_);
  }
  const double of_curvature = w.curvature_variance / (w.curvature * w.curvature) +
                              options_.shared.curvature * options_.shared.curvature;
  a.bent = table_.curvature_where(found_, w.unevenness / (w.curvature * w.curvature));
  a.reduced_albedo = found_.reduced_albedo;
  a.decay = std::sqrt(3.0 * (1.0 - found_.reduced_albedo));
  a.shift = kTiltDepth * a.decay * a.bent / options_.ior;  // 3 D H / ior, times that
  const auto& s = found_.sensitivity;
  const double by_reflectance = s[0] + s[2];
  const double by_ratio = s[1] + s[3];
  const double by_uneven = kUnevenDeviation * std::log(found_.curvature / a.bent);
  const double of_reflectance = reflectance_variance(w);
  a.log_variance = by_reflectance * by_reflectance * of_reflectance +
                   by_ratio * by_ratio * of_ratio + of_curvature +
                   kTableDeviation * kTableDeviation + kShapeDeviation * kShapeDeviation +
                   by_uneven * by_uneven + index.log_diffusion * index.log_diffusion;
  const double decay_variance =
      s[0] * s[0] * of_reflectance + s[1] * s[1] * of_ratio + index.log_decay * index.log_decay;
  a.albedo_deviation =  // d alpha' = -2/3 g^2 d ln g
      2.0 / 3.0 * a.decay * a.decay * std::sqrt(decay_variance);
  return a;
}

}  // namespace opaline::reconstruct
