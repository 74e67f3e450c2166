#include "sim/sensor.h"

#include <algorithm>
#include <cmath>

namespace opaline::sim {
namespace {

/// Numerator or denominator of AS 241's rational approximations, highest power first.
template <std::size_t N>
double horner(const std::array<double, N>& coefficients, double x) {
  double value = 0.0;
  for (const double coefficient : coefficients) value = value * x + coefficient;
  return value;
}

constexpr std::array kCentreOver{
    5.9109374720e+1, 1.5929113202e+2, 5.0434271938e+1, 3.3871327179e+0};
constexpr std::array kCentreUnder{6.7187563600e+1, 7.8757757664e+1, 1.7895169469e+1, 1.0};
constexpr std::array kNearOver{1.7023821103e-1, 1.3067284816e+0, 2.7568153900e+0, 1.4234372777e+0};
constexpr std::array kNearUnder{1.2021132975e-1, 7.3700164250e-1, 1.0};
constexpr std::array kFarOver{1.7337203997e-2, 4.2868294337e-1, 3.0812263860e+0, 6.6579051150e+0};
constexpr std::array kFarUnder{1.2258202635e-2, 2.4197894225e-1, 1.0};

double tail_quantile(double smaller_probability) {
  const double r = std::sqrt(-std::log(smaller_probability));
  return r <= 5.0 ? horner(kNearOver, r - 1.6) / horner(kNearUnder, r - 1.6)
                  : horner(kFarOver, r - 5.0) / horner(kFarUnder, r - 5.0);
}

double poisson_by_summation(double mean, double probability) {
  double term = std::exp(-mean);
  double sum = term;
  int n = 0;
  while (sum < probability && n < 400) {
    ++n;
    term *= mean / n;
    sum += term;
  }
  return n;
}

}  // namespace

double normal_quantile(double probability) {
  const double q = probability - 0.5;
  if (std::abs(q) <= 0.425) {
    const double r = 0.180625 - q * q;
    return q * horner(kCentreOver, r) / horner(kCentreUnder, r);
  }
  return std::copysign(tail_quantile(std::min(probability, 1.0 - probability)), q);
}

double poisson_quantile(double mean, double probability) {
  if (mean <= 0.0) return 0.0;
  if (mean < 32.0) return poisson_by_summation(mean, probability);
  const double z = normal_quantile(probability);
  return std::max(0.0, std::round(mean + std::sqrt(mean) * z + (z * z - 1.0) / 6.0));
}

Sensor::Sensor(const CameraOptics& options, std::uint64_t seed)
    : options_(options),
      vignetting_(vignetting_map(options.model.width, options.model.height, options.vignetting)),
      leak_(options.model.width,
            options.model.height,
            3,
            static_cast<float>(options.dark_electrons_per_second)) {
  const std::uint64_t key = mix(seed, 0x686f74);  // "hot"
  for (std::size_t i = 0; i < leak_.samples().size(); ++i) {
    const bool hot = uniform(mix(key, i / 3)) < options.hot_pixel_fraction;
    if (hot) leak_.samples()[i] += static_cast<float>(options.hot_pixel_electrons_per_second);
  }
}

double Sensor::noisy_electrons(double mean, std::uint64_t hash) const {
  const double collected =
      std::min(poisson_quantile(mean, uniform(hash)), options_.full_well_electrons);
  return collected + options_.read_noise_electrons * normal_quantile(uniform(mix(hash, 1)));
}

std::uint16_t Sensor::code(double electrons) const {
  const double range = options_.max_code() - options_.black_level;
  double x = electrons / (options_.gain_electrons_per_code * range);
  if (options_.response_gamma != 1.0) {
    x = std::copysign(std::pow(std::abs(x), 1.0 / options_.response_gamma), x);
  }
  const double code = std::round(options_.black_level + range * x);
  return static_cast<std::uint16_t>(std::clamp(code, 0.0, options_.max_code()));
}

Image<std::uint16_t> Sensor::read(const Image<float>& light,
                                  double seconds,
                                  std::uint64_t key) const {
  Image<std::uint16_t> codes(light.width(), light.height(), 3);
  for (std::size_t i = 0; i < codes.samples().size(); ++i) {
    const double mean =
        options_.sensitivity[i % 3] * light.samples()[i] * vignetting_.samples()[i / 3] +
        leak_.samples()[i] * seconds;
    codes.samples()[i] = code(noisy_electrons(mean, mix(key, i)));
  }
  return codes;
}

}  // namespace opaline::sim
