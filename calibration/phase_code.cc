#include "calibration/phase_code.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "calibration/homography.h"

namespace opaline::calibration {
namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;
constexpr double kNear = 0.9;    // of the corners' distance
constexpr double kBright = 0.6;  // of the window's brightest modulation
constexpr int kFromEdge = 2;     // px
constexpr std::size_t kFewestPixels = 40;
constexpr int kTrims = 3;
constexpr double kTrimmed = 3.0;   // sigmas
constexpr double kScatters = 0.5;  // projector px
constexpr int kFewestCornersSeen = 8;

struct Phase {
  float turns = 0.0f;  // 0 to 1
  float modulation = 0.0f;
};

Phase phase_of(std::span<const Image<float>> pictures, std::size_t sample) {
  double s = 0.0;
  double c = 0.0;
  const auto steps = static_cast<double>(pictures.size());
  for (std::size_t k = 0; k < pictures.size(); ++k) {
    const double angle = kTurn * static_cast<double>(k) / steps;
    s += pictures[k].samples()[sample] * std::sin(angle);
    c += pictures[k].samples()[sample] * std::cos(angle);
  }
  const double turns = std::atan2(s, c) / kTurn;
  return {static_cast<float>(turns < 0.0 ? turns + 1.0 : turns),
          static_cast<float>(2.0 / steps * std::hypot(s, c))};
}

// One axis; NaN where a period shows less than that.
Phase place_of(const PhasePlan& plan,
               std::span<const Image<float>> pictures,
               std::size_t sample,
               double least) {
  double place = 0.0;
  Phase phase;
  const auto steps = static_cast<std::size_t>(plan.steps);
  for (std::size_t level = 0; level < plan.shares.size(); ++level) {
    phase = phase_of(pictures.subspan(level * steps, steps), sample);
    if (phase.modulation < least) return {std::numeric_limits<float>::quiet_NaN(), 0.0f};
    const double period = plan.period(level);
    const double turn = level == 0 ? 0.0 : std::round(place / period - phase.turns);
    place = (turn + phase.turns) * period;
  }
  return {static_cast<float>(place), phase.modulation};
}

std::optional<double> distance_to_neighbour(const BoardView& view, const Board& board, int id) {
  const auto at = [&](int other) {
    return std::ranges::find(view.corners, other, &BoardCorner::id);
  };
  const auto here = at(id);
  double least = std::numeric_limits<double>::infinity();
  for (const int step : {-1, 1, -board.columns(), board.columns()}) {
    const bool wraps = std::abs(step) == 1 && (id + step) / board.columns() != id / board.columns();
    if (id + step < 0 || wraps) continue;
    const auto there = at(id + step);
    if (there == view.corners.end()) continue;
    least =
        std::min(least, std::hypot(there->pixel.x - here->pixel.x, there->pixel.y - here->pixel.y));
  }
  return std::isfinite(least) ? std::optional(least) : std::nullopt;
}

struct Window {
  int x0 = 0;
  int y0 = 0;
  int x1 = 0;
  int y1 = 0;
};

Window window_about(const ProjectorMap& map, CameraModel::Pixel middle, double reach) {
  const auto whole = [](double v) { return static_cast<int>(std::floor(v)); };
  return {std::max(kFromEdge, whole(middle.x - reach)),
          std::max(kFromEdge, whole(middle.y - reach)),
          std::min(map.x.width() - 1 - kFromEdge, whole(middle.x + reach)),
          std::min(map.x.height() - 1 - kFromEdge, whole(middle.y + reach))};
}

bool is_inside_white(const ProjectorMap& map, int x, int y, float bright) {
  for (int j = -kFromEdge; j <= kFromEdge; ++j) {
    for (int i = -kFromEdge; i <= kFromEdge; ++i) {
      if (!(map.modulation.at(x + i, y + j) >= bright) || !std::isfinite(map.x.at(x + i, y + j)) ||
          !std::isfinite(map.y.at(x + i, y + j)))
        return false;
    }
  }
  return true;
}

std::vector<PlanePair> white_pixels(const ProjectorMap& map, const Window& w) {
  float brightest = 0.0f;
  for (int y = w.y0; y <= w.y1; ++y) {
    for (int x = w.x0; x <= w.x1; ++x) brightest = std::max(brightest, map.modulation.at(x, y));
  }
  const auto bright = static_cast<float>(kBright) * brightest;
  std::vector<PlanePair> pairs;
  for (int y = w.y0; y <= w.y1; ++y) {
    for (int x = w.x0; x <= w.x1; ++x) {
      if (brightest > 0.0f && is_inside_white(map, x, y, bright))
        pairs.push_back({{x + 0.5, y + 0.5}, {map.x.at(x, y), map.y.at(x, y)}});
    }
  }
  return pairs;
}

double scatter_of(const Homography& h, const std::vector<PlanePair>& pairs) {
  double squares = 0.0;
  for (const PlanePair& pair : pairs) {
    const auto p = carry(h, pair.from);
    squares += (p.x - pair.to.x) * (p.x - pair.to.x) + (p.y - pair.to.y) * (p.y - pair.to.y);
  }
  return std::sqrt(squares / static_cast<double>(pairs.size()));
}

// Without the pixels that were unwrapped wrongly.
std::optional<Homography> local_homography(std::vector<PlanePair> pairs) {
  std::optional<Homography> h;
  for (int trim = 0; trim <= kTrims; ++trim) {
    if (pairs.size() < kFewestPixels) return std::nullopt;
    h = fit_homography(pairs);
    if (!h) return std::nullopt;
    const double limit = kTrimmed * scatter_of(*h, pairs);
    std::erase_if(pairs, [&](const PlanePair& pair) {
      const auto p = carry(*h, pair.from);
      return std::hypot(p.x - pair.to.x, p.y - pair.to.y) > limit;
    });
  }
  if (scatter_of(*h, pairs) > kScatters) return std::nullopt;
  return h;
}

}  // namespace

double PhasePlan::period(std::size_t level) const {
  return shares[level] * std::max(width, height);
}

Image<std::uint8_t> phase_pattern(const PhasePlan& plan, int index) {
  const auto levels = static_cast<int>(plan.shares.size());
  const int axis = index / (levels * plan.steps);
  const auto level = static_cast<std::size_t>(index / plan.steps % levels);
  const double shift = static_cast<double>(index % plan.steps) / plan.steps;
  Image<std::uint8_t> codes(plan.width, plan.height, 1);
  for (int y = 0; y < plan.height; ++y) {
    for (int x = 0; x < plan.width; ++x) {
      const double place = (axis == 0 ? x : y) + 0.5;
      const double light = 0.5 + 0.5 * std::cos(kTurn * (place / plan.period(level) - shift));
      codes.at(x, y) = static_cast<std::uint8_t>(
          std::lround(plan.white * std::pow(std::max(0.0, light), 1.0 / plan.gamma)));
    }
  }
  return codes;
}

Result<ProjectorMap> decode_phases(const PhasePlan& plan,
                                   std::span<const Image<float>> pictures,
                                   double least) {
  if (static_cast<int>(pictures.size()) != plan.count())
    return invalid_argument(
        fmt::format("{} pictures of {} patterns", pictures.size(), plan.count()));
  for (const Image<float>& picture : pictures) {
    if (picture.channels() != 1 || picture.width() != pictures[0].width() ||
        picture.height() != pictures[0].height())
      return invalid_argument("pictures of the patterns differ in size");
  }
  const int width = pictures[0].width();
  const int height = pictures[0].height();
  ProjectorMap map{Image<float>(width, height, 1),
                   Image<float>(width, height, 1),
                   Image<float>(width, height, 1),
                   Image<float>(width, height, 1)};
  for (const Image<float>& picture : pictures) {
    for (std::size_t i = 0; i < picture.samples().size(); ++i)
      map.mean.samples()[i] += picture.samples()[i] / static_cast<float>(pictures.size());
  }
  const auto half = pictures.size() / 2;
  for (std::size_t i = 0; i < map.x.samples().size(); ++i) {
    const Phase x = place_of(plan, pictures.first(half), i, least);
    const Phase y = place_of(plan, pictures.subspan(half), i, least);
    map.x.samples()[i] = x.turns;
    map.y.samples()[i] = y.turns;
    map.modulation.samples()[i] = std::min(x.modulation, y.modulation);
  }
  return map;
}

BoardView projector_view(const ProjectorMap& map,
                         const BoardView& camera_view,
                         const Board& board) {
  BoardView view;
  view.name = camera_view.name;
  view.fault = camera_view.fault;
  if (!view.fault.empty()) return view;
  for (const BoardCorner& corner : camera_view.corners) {
    const auto spacing = distance_to_neighbour(camera_view, board, corner.id);
    if (!spacing) continue;
    const Window window = window_about(map, corner.pixel, kNear * *spacing);
    const auto h = local_homography(white_pixels(map, window));
    if (h) view.corners.push_back({corner.id, carry(*h, corner.pixel)});
  }
  if (static_cast<int>(view.corners.size()) < kFewestCornersSeen)
    view.fault = fmt::format("the projected patterns can be read about {} of {} corners",
                             view.corners.size(),
                             camera_view.corners.size());
  return view;
}

}  // namespace opaline::calibration
