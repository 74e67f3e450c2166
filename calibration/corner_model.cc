#include "calibration/corner_model.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

namespace opaline::calibration {
namespace {

constexpr int kUnknowns = 11;
constexpr int kMostSteps = 40;
constexpr double kStill = 1e-5;       // px
constexpr double kMostMoved = 1.5;    // px
constexpr double kMostLeft = 0.3;     // of half the step from black to white
constexpr double kLeastBlur = 0.2;    // px
constexpr double kLeastAngle = 0.35;  // radian between the edges
constexpr double kLeastStep = 4.0;    // codes
constexpr double kGiveUp = 1e8;

using Unknowns = Eigen::Matrix<double, kUnknowns, 1>;  // x y angle angle blur a bx by c dx dy
using Normal = Eigen::Matrix<double, kUnknowns, kUnknowns>;

struct Pixel {
  double x = 0.0;  // from the guess
  double y = 0.0;
  double code = 0.0;
};

struct Edge {
  double value = 0.0;  // e
  double by_x = 0.0;   // derivatives by the corner's place, the edge's angle, and the blur
  double by_y = 0.0;
  double by_angle = 0.0;
  double by_blur = 0.0;
};

Edge edge_at(double u, double v, double angle, double blur) {
  const double cosine = std::cos(angle);
  const double sine = std::sin(angle);
  const double off = -u * sine + v * cosine;
  const double along = u * cosine + v * sine;
  const double z = off / (std::numbers::sqrt2 * blur);
  const double slope =
      2.0 / std::sqrt(std::numbers::pi) * std::exp(-z * z) / (std::numbers::sqrt2 * blur);
  return {std::erf(z), slope * sine, -slope * cosine, -slope * along, -slope * off / blur};
}

double model_at(const Unknowns& p, const Pixel& at, Unknowns* derivative) {
  const Edge one = edge_at(at.x - p[0], at.y - p[1], p[2], p[4]);
  const Edge two = edge_at(at.x - p[0], at.y - p[1], p[3], p[4]);
  const double step = p[8] + p[9] * at.x + p[10] * at.y;
  const double alike = one.value * two.value;
  if (derivative != nullptr) {
    *derivative << step * (one.by_x * two.value + one.value * two.by_x),
        step * (one.by_y * two.value + one.value * two.by_y), step * one.by_angle * two.value,
        step * one.value * two.by_angle, step * (one.by_blur * two.value + one.value * two.by_blur),
        1.0, at.x, at.y, alike, alike * at.x, alike * at.y;
  }
  return p[5] + p[6] * at.x + p[7] * at.y + step * alike;
}

double squares_of(const Unknowns& p, const std::vector<Pixel>& pixels) {
  double sum = 0.0;
  for (const Pixel& pixel : pixels) {
    const double left = pixel.code - model_at(p, pixel, nullptr);
    sum += left * left;
  }
  return sum;
}

std::vector<Pixel> disc_about(const Image<std::uint8_t>& grey,
                              CameraModel::Pixel place,
                              double radius) {
  const auto first = [radius](double v) { return static_cast<int>(std::floor(v - radius)); };
  const auto last = [radius](double v) { return static_cast<int>(std::floor(v + radius)); };
  if (first(place.x) < 0 || first(place.y) < 0 || last(place.x) >= grey.width() ||
      last(place.y) >= grey.height())
    return {};
  std::vector<Pixel> pixels;
  for (int y = first(place.y); y <= last(place.y); ++y) {
    for (int x = first(place.x); x <= last(place.x); ++x) {
      const double u = x + 0.5 - place.x;
      const double v = y + 0.5 - place.y;
      if (u * u + v * v <= radius * radius)
        pixels.push_back({u, v, static_cast<double>(grey.at(x, y))});
    }
  }
  return pixels;
}

Unknowns begin_at(const CornerGuess& guess, const std::vector<Pixel>& pixels) {
  Unknowns p = Unknowns::Zero();
  p[2] = guess.first_angle;
  p[3] = guess.second_angle;
  p[4] = std::max(kLeastBlur, guess.blur_px);
  double squares = 0.0;
  for (const Pixel& pixel : pixels) p[5] += pixel.code / static_cast<double>(pixels.size());
  for (const Pixel& pixel : pixels) {
    const double alike =
        edge_at(pixel.x, pixel.y, p[2], p[4]).value * edge_at(pixel.x, pixel.y, p[3], p[4]).value;
    p[8] += alike * (pixel.code - p[5]);
    squares += alike * alike;
  }
  p[8] /= squares;
  return p;
}

bool is_sensible(const Unknowns& p) {
  return std::hypot(p[0], p[1]) <= kMostMoved && p[4] >= kLeastBlur && std::isfinite(p[8]) &&
         std::abs(std::sin(p[2] - p[3])) > std::sin(kLeastAngle);
}

// Levenberg and Marquardt; the squares that are left.
double minimise(Unknowns& p, const std::vector<Pixel>& pixels) {
  double best = squares_of(p, pixels);
  double damping = 1e-3;
  for (int n = 0; n < kMostSteps && damping < kGiveUp; ++n) {
    Normal normal = Normal::Zero();
    Unknowns slope = Unknowns::Zero();
    Unknowns d;
    for (const Pixel& pixel : pixels) {
      const double left = pixel.code - model_at(p, pixel, &d);
      normal.noalias() += d * d.transpose();
      slope += left * d;
    }
    normal.diagonal() *= 1.0 + damping;
    const Unknowns step = normal.ldlt().solve(slope);
    const Unknowns tried = p + step;
    const double squares = is_sensible(tried) ? squares_of(tried, pixels) : 2.0 * best + 1.0;
    if (squares > best) {
      damping *= 10.0;
      continue;
    }
    p = tried;
    best = squares;
    damping *= 0.1;
    if (std::hypot(step[0], step[1]) < kStill) break;
  }
  return best;
}

}  // namespace

std::optional<ModelledCorner> fit_corner(const Image<std::uint8_t>& grey,
                                         const CornerGuess& guess,
                                         double radius) {
  const std::vector<Pixel> pixels = disc_about(grey, guess.place, radius);
  if (pixels.size() <= kUnknowns) return std::nullopt;
  Unknowns p = begin_at(guess, pixels);
  if (!is_sensible(p) || std::abs(p[8]) < kLeastStep) return std::nullopt;
  const double squares = minimise(p, pixels);
  const double rms = std::sqrt(squares / static_cast<double>(pixels.size())) / std::abs(p[8]);
  if (!(rms < kMostLeft)) return std::nullopt;
  return ModelledCorner{{guess.place.x + p[0], guess.place.y + p[1]}, p[4], rms, p[8]};
}

}  // namespace opaline::calibration
