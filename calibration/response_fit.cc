#include "calibration/response_fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "calibration/response_equations.h"
#include "calibration/response_pixels.h"

namespace opaline::calibration {
namespace {

constexpr int kTable = 257;
constexpr double kToe = 1.5;  // times the lowest code that tells

// Isotonic regression by pooling neighbours that fall (Ayer et al. 1955).
void pool_falling(std::vector<double>& values) {
  struct Block {
    double sum;
    std::size_t count;
    double mean() const { return sum / static_cast<double>(count); }
  };
  std::vector<Block> blocks;
  for (const double value : values) {
    blocks.push_back({value, 1});
    while (blocks.size() > 1 && blocks[blocks.size() - 2].mean() > blocks.back().mean()) {
      const Block last = blocks.back();
      blocks.pop_back();
      blocks.back().sum += last.sum;
      blocks.back().count += last.count;
    }
  }
  std::size_t i = 0;
  for (const Block& block : blocks) {
    for (std::size_t k = 0; k < block.count; ++k) values[i++] = block.mean();
  }
}

// Where no sample tells: the power of f that the curve goes with just above.
double toe(const Eigen::VectorXd& unknowns, double from, double f) {
  const double at = response_between(unknowns, from);
  const double power = (response_between(unknowns, kToe * from) - at) / std::log(kToe);
  return f * std::exp(at + power * std::log(f / from));
}

capture::ResponseCurve curve_of(const Eigen::VectorXd& unknowns, double lowest) {
  std::vector<double> table{0.0};
  for (int i = 1; i < kTable; ++i) {
    const double f = static_cast<double>(i) / (kTable - 1);
    table.push_back(f < lowest ? toe(unknowns, lowest, f)
                               : f * std::exp(response_between(unknowns, f)));
  }
  pool_falling(table);
  const double full = table.back();
  for (int i = 0; i < kTable; ++i) {
    const double ramp = 1e-9 * i;  // strictly increasing where values were pooled
    table[static_cast<std::size_t>(i)] =
        (table[static_cast<std::size_t>(i)] / full + ramp) / (1.0 + 1e-9 * (kTable - 1));
  }
  table.front() = 0.0;
  table.back() = 1.0;
  return {capture::ResponseCurve::Kind::kTable, 1.0, std::move(table)};
}

}  // namespace

Result<ResponseFit> fit_response(std::span<const Exposure> stack, CodeRange range, int channel) {
  if (auto checked = check_stack(stack, range, channel); !checked) return checked.error();
  ResponsePixels pixels = collect_pixels(stack, range, channel);
  if (auto told = check_told(pixels, range); !told) return told.error();
  const Eigen::VectorXd unknowns = solve_response(pixels.telling, stack);
  ResponseFit result{curve_of(unknowns, lowest_fraction(range)), {}, 0.0, 0, pixels.refused};
  for (std::size_t j = 0; j < stack.size(); ++j) {
    result.seconds.push_back(stack[j].seconds *
                             std::exp(unknowns[kResponseKnots + static_cast<int>(j)]));
  }
  double squares = 0.0;
  for (const ResponsePixel& pixel : pixels.telling) {
    if (pixel.trust < 0.05) {
      ++result.pixels_refused;
      continue;
    }
    ++result.pixels_used;
    squares += pixel.residual * pixel.residual;
  }
  result.residual = std::sqrt(squares / std::max(1, result.pixels_used));
  return result;
}

double signal_at(const capture::ResponseCurve& curve, double fraction) {
  const double f = std::clamp(fraction, 0.0, 1.0);
  if (curve.kind == capture::ResponseCurve::Kind::kLinear) return f;
  if (curve.kind == capture::ResponseCurve::Kind::kGamma) return std::pow(f, curve.gamma);
  const double at = f * static_cast<double>(curve.table.size() - 1);
  const std::size_t i = std::min(static_cast<std::size_t>(at), curve.table.size() - 2);
  const double share = at - static_cast<double>(i);
  return (1.0 - share) * curve.table[i] + share * curve.table[i + 1];
}

double departure_from_line(const capture::ResponseCurve& curve) {
  double products = 0.0;
  double squares = 0.0;
  for (int i = 5; i <= 95; ++i) {
    const double f = 0.01 * i;
    products += f * signal_at(curve, f);
    squares += f * f;
  }
  double most = 0.0;
  for (int i = 5; i <= 95; ++i) {
    const double f = 0.01 * i;
    most = std::max(most, std::abs(signal_at(curve, f) - products / squares * f));
  }
  return most;
}

}  // namespace opaline::calibration
