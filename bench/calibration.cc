// What the station finds out about a simulated sensor, against what the sensor was made from. Prints one JSON object a
// figure (bench/figure.h): response.rmse, a share of full scale over 5 to 95 % of the range, the worst of 8, 12 and 16
// bits with gamma 2.2; hdr.bias, and hdr.variance_over_crb, the worst of 48 lights from 30 to 280000 electrons a second,
// against the bound 1 / sum t^2 / var(light - black) over the exposures that do not clip; capture.time_ratio_vs_fixed_bracket,
// the time that exposures of 1/30 to 8 s take, each four times (sim_one_stop: twice) the one before, over that of planned ones
// with the same goal, black frames included, the worse of marble and wax in the demo's station; and
// capture.time_over_photon_limit, of the planned ones without black frames over what photon noise alone asks for; and colour.de2000_mean, _p95 and _max, CIEDE2000 of the patches of a
// ColorChecker by corrections that did not know them, at three exposures: root polynomials (sim) and a matrix (sim_matrix).
//
//   calibration

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

#include "bench/calibrate/capture_time.h"
#include "bench/calibrate/chart_colors.h"
#include "bench/calibrate/geometry_case.h"
#include "bench/figure.h"
#include "calibration/response_fit.h"
#include "capture/hdr_merge.h"
#include "sim/sensor.h"

namespace opaline::bench {
namespace {

constexpr int kWidth = 192;
constexpr int kHeight = 128;
constexpr double kGamma = 2.2;
constexpr int kRates = 48;         // so close that each exposure's limit lies between two of them
constexpr double kDimmest = 30.0;  // electrons a second
constexpr double kBrightest = 2.8e5;  // 93 % of a full pixel in the shortest exposure

sim::CameraOptics optics(int bits) {
  sim::CameraOptics o;
  o.model.width = kWidth;
  o.model.height = kHeight;
  o.bit_depth = bits;
  o.black_level = bits == 8 ? 4.0 : bits == 12 ? 64.0 : 1024.0;
  o.gain_electrons_per_code = 10000.0 / (o.max_code() - o.black_level);
  o.vignetting = {0.0, 0.0, 0.0};
  return o;
}

Image<float> ramp(double seconds) {
  Image<float> light(kWidth, kHeight, 3);
  const auto size = static_cast<double>(light.samples().size());
  for (std::size_t i = 0; i < light.samples().size(); ++i) {
    const double share = static_cast<double>(i) / size;
    light.samples()[i] = static_cast<float>(seconds * 2e-4 * std::pow(400.0, share - 1.0));
  }
  return light;
}

Result<double> response_error(int bits) {
  sim::CameraOptics o = optics(bits);
  o.response_gamma = kGamma;
  const sim::Sensor sensor(o, 7);
  std::vector<Image<std::uint16_t>> frames;
  std::vector<double> seconds;
  for (int frame = 0; frame < 7; ++frame) {
    const double t = std::ldexp(1.0 / 60.0, frame);
    frames.push_back(sensor.read(ramp(t), t, frames.size()));
    seconds.push_back(t);
  }
  std::vector<calibration::Exposure> stack;
  for (std::size_t j = 0; j < frames.size(); ++j) stack.push_back({&frames[j], seconds[j]});
  const auto fit = calibration::fit_response(stack, {o.black_level, o.max_code()}, 1);
  if (!fit) return fit.error();
  double squares = 0.0;
  for (int i = 5; i <= 95; ++i) {
    const double error = calibration::signal_at(fit->curve, 0.01 * i) - std::pow(0.01 * i, kGamma);
    squares += error * error;
  }
  return std::sqrt(squares / 91.0);
}

struct Merged {
  double bias = 0.0;
  double over_bound = 0.0;
};

// 1 / the variance of the light that the exposures can tell at best.
double information(const sim::CameraOptics& o, double rate, const std::vector<double>& seconds) {
  double sum = 0.0;
  const double read = o.read_noise_electrons * o.read_noise_electrons +
                      o.gain_electrons_per_code * o.gain_electrons_per_code / 12.0;
  for (const double t : seconds) {
    const double electrons = rate * t;
    const double clips = o.gain_electrons_per_code * (o.max_code() - o.black_level);
    if (electrons + 4.0 * std::sqrt(electrons) > clips) continue;
    sum += t * t / (electrons + 2.0 * (o.dark_electrons_per_second * t + read));
  }
  return sum;
}

Merged merge_at(double rate) {
  sim::CameraOptics o = optics(12);
  o.hot_pixel_fraction = 0.0;
  const sim::Sensor sensor(o, 3);
  const std::vector<double> seconds{1.0 / 30, 4.0 / 30, 16.0 / 30, 64.0 / 30, 8.0};
  std::vector<Image<std::uint16_t>> frames;
  for (const double t : seconds) {
    for (const double light : {rate * t * 1e-9, 0.0}) {
      frames.push_back(sensor.read(
          Image<float>(kWidth, kHeight, 3, static_cast<float>(light)), t, 100 + frames.size()));
    }
  }
  std::vector<capture::ExposurePair> pairs;
  for (std::size_t j = 0; j < seconds.size(); ++j) {
    pairs.push_back({&frames[2 * j], &frames[2 * j + 1], seconds[j], seconds[j]});
  }
  capture::CameraCalibration camera;
  camera.model = o.model;
  camera.gain_electrons_per_code = o.gain_electrons_per_code;
  const auto hdr = capture::HdrMerge(camera, Image<std::uint8_t>(kWidth, kHeight, 1)).merge(pairs);
  double sum = 0.0;
  double squares = 0.0;
  const auto n = static_cast<double>(hdr.radiance.samples().size());
  for (const float radiance : hdr.radiance.samples()) {
    const double difference = radiance * 1e9 - rate;
    sum += difference;
    squares += difference * difference;
  }
  const double variance = squares / n - (sum / n) * (sum / n);
  return {std::abs(sum / n) / rate, variance * information(o, rate, seconds)};
}

bool print_capture_time() {
  double least = 1e9;
  double least_one_stop = 1e9;
  double over_limit = 0.0;
  for (const auto kind : {sim::SceneKind::kMarble, sim::SceneKind::kWax}) {
    sim::SceneOptions scene;
    scene.kind = kind;
    const auto time = capture_time(scene);
    if (!time) {
      fmt::print(stderr, "calibration: {}: {}\n", sim::to_string(kind), time.error().message);
      return false;
    }
    const double lights = time->planned - time->planned_black;
    fmt::print(stderr,
               "{}: fixed {:.1f} s, planned {:.1f} s ({:.1f} of them black), photon limit {:.1f} "
               "s, {} lights out of "
               "reach; at least {:.1f} % of cells reach SNR 100; variance said over found {:.3f}\n",
               sim::to_string(kind),
               time->fixed,
               time->planned,
               time->planned_black,
               time->photon_limit,
               time->out_of_reach,
               100.0 * time->share_reached,
               time->realised);
    least = std::min(least, time->fixed / time->planned);
    least_one_stop = std::min(least_one_stop, time->one_stop / time->planned);
    over_limit = std::max(over_limit, lights / time->photon_limit);
  }
  print_figure("capture.time_ratio_vs_fixed_bracket", "sim", least, "1");
  print_figure("capture.time_ratio_vs_fixed_bracket", "sim_one_stop", least_one_stop, "1");
  print_figure("capture.time_over_photon_limit", "sim", over_limit, "1");
  return true;
}

bool print_colors() {
  const auto colors = chart_colors();
  if (!colors) {
    fmt::print(stderr, "calibration: {}\n", colors.error().message);
    return false;
  }
  for (const auto& [name, error] :
       {std::pair{"sim", colors->root_polynomial}, std::pair{"sim_matrix", colors->matrix}}) {
    print_figure("colour.de2000_mean", name, error.mean, "1");
    print_figure("colour.de2000_p95", name, error.p95, "1");
    print_figure("colour.de2000_max", name, error.most, "1");
  }
  return true;
}

int run() {
  double worst = 0.0;
  for (const int bits : {8, 12, 16}) {
    const auto error = response_error(bits);
    if (!error) {
      fmt::print(stderr, "calibration: {} bits: {}\n", bits, error.error().message);
      return 1;
    }
    worst = std::max(worst, *error);
  }
  print_figure("response.rmse", "sim", worst, "of full scale");
  Merged most;
  for (int step = 0; step < kRates; ++step) {
    const double rate = kDimmest * std::pow(kBrightest / kDimmest, step / (kRates - 1.0));
    const Merged merged = merge_at(rate);
    fmt::print(stderr,
               "{:8.0f} e/s: bias {:.5f}, {:.3f} of the bound\n",
               rate,
               merged.bias,
               merged.over_bound);
    most.bias = std::max(most.bias, merged.bias);
    most.over_bound = std::max(most.over_bound, merged.over_bound);
  }
  print_figure("hdr.bias", "sim", most.bias, "1");
  print_figure("hdr.variance_over_crb", "sim", most.over_bound, "1");
  return print_colors() && print_capture_time() && print_geometry(1) ? 0 : 1;
}

}  // namespace
}  // namespace opaline::bench

int main() { return opaline::bench::run(); }
