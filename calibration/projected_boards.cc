#include "calibration/projected_boards.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "calibration/corner_model.h"
#include "calibration/homography.h"

namespace opaline::calibration {
namespace {

using Pixel = CameraModel::Pixel;

constexpr int kSquaresAcross = 40;
constexpr float kWhite = 0.3f;         // of the brightest paper; ink is a tenth of it
constexpr float kBrightest = 0.98f;    // quantile
constexpr float kEven = 0.9f;          // the darkest pixel about a corner over the brightest
constexpr double kFromPrint = 1.0;     // px of even paper around a corner's disc
constexpr double kSmallestDisc = 3.0;  // px
constexpr double kLargestDisc = 14.0;  // px
constexpr double kDiscShare = 0.45;    // of a projected square
constexpr double kBlur = 0.9;          // px, to begin with
constexpr float kFullCode = 200.0f;    // of a lit square
constexpr int kCoarseStep = 3;         // px
constexpr double kLeastFound = 0.5;    // of the corners that the print leaves room for
constexpr std::size_t kFewestPairs = 40;
constexpr int kTrims = 3;
constexpr double kTrimmed = 3.0;   // deviations
constexpr double kScatters = 0.5;  // projector px
constexpr int kFewestCornersSeen = 8;

constexpr int kDegree = 5;
constexpr int kTerms = (kDegree + 1) * (kDegree + 2) / 2;
using Terms = Eigen::Matrix<double, kTerms, 1>;

double distance(Pixel a, Pixel b) { return std::hypot(a.x - b.x, a.y - b.y); }

/// One lens's picture of a plane to another's: projected_boards.h.
class PlaneMap {
 public:
  static std::optional<PlaneMap> fit(std::span<const PlanePair> pairs) {
    const auto h = fit_homography(pairs);
    if (!h) return std::nullopt;
    PlaneMap map;
    map.h_ = *h;
    for (const PlanePair& pair : pairs) {
      map.middle_.x += pair.from.x / static_cast<double>(pairs.size());
      map.middle_.y += pair.from.y / static_cast<double>(pairs.size());
    }
    for (const PlanePair& pair : pairs)
      map.reach_ = std::max(map.reach_, distance(pair.from, map.middle_));
    Eigen::Matrix<double, kTerms, kTerms> normal = Eigen::Matrix<double, kTerms, kTerms>::Zero();
    Eigen::Matrix<double, kTerms, 2> right = Eigen::Matrix<double, kTerms, 2>::Zero();
    for (const PlanePair& pair : pairs) {
      const Terms t = map.terms(pair.from);
      const Pixel flat = carry(*h, pair.from);
      normal += t * t.transpose();
      right += t * Eigen::RowVector2d(pair.to.x - flat.x, pair.to.y - flat.y);
    }
    map.bent_ = normal.ldlt().solve(right);
    return map;
  }

  Pixel operator()(Pixel from) const {
    const Pixel flat = carry(h_, from);
    const Eigen::RowVector2d bent = terms(from).transpose() * bent_;
    return {flat.x + bent[0], flat.y + bent[1]};
  }

  double scatter(std::span<const PlanePair> pairs) const {
    double squares = 0.0;
    for (const PlanePair& pair : pairs)
      squares += std::pow(distance((*this)(pair.from), pair.to), 2);
    return std::sqrt(squares / static_cast<double>(pairs.size()));
  }

 private:
  Terms terms(Pixel p) const {
    const double x = (p.x - middle_.x) / reach_;
    const double y = (p.y - middle_.y) / reach_;
    Terms t;
    t[0] = 1.0;
    for (int degree = 1, n = 1; degree <= kDegree; ++degree) {  // x t and then y^degree
      for (int i = 0; i < degree; ++i, ++n) t[n] = x * t[n - degree];
      t[n] = y * t[n - degree - 1];
      ++n;
    }
    return t;
  }
  Homography h_{};
  Pixel middle_;
  double reach_ = 1e-9;
  Eigen::Matrix<double, kTerms, 2> bent_;
};

// Leaves the pairs that fit.
std::optional<PlaneMap> fit_trimmed(std::vector<PlanePair>& pairs) {
  std::optional<PlaneMap> map;
  for (int trim = 0; trim <= kTrims; ++trim) {
    if (pairs.size() < kFewestPairs) return std::nullopt;
    map = PlaneMap::fit(pairs);
    if (!map || trim == kTrims) return map;
    const double limit = kTrimmed * map->scatter(pairs);
    std::erase_if(pairs,
                  [&](const PlanePair& p) { return distance((*map)(p.from), p.to) > limit; });
  }
  return map;
}

/// The printed board under even light, and which place of the projector's picture lights it.
class Paper {
 public:
  explicit Paper(const ProjectorMap& coarse) : coarse_(coarse) {
    std::vector<float> lit;
    for (std::size_t i = 0; i < coarse.mean.samples().size(); ++i) {
      if (std::isfinite(coarse.x.samples()[i]) && std::isfinite(coarse.y.samples()[i]))
        lit.push_back(coarse.mean.samples()[i]);
    }
    if (lit.empty()) return;
    const auto high =
        lit.begin() + static_cast<std::ptrdiff_t>(kBrightest * static_cast<float>(lit.size() - 1));
    std::ranges::nth_element(lit, high);
    white_ = kWhite * *high;
  }

  /// From projector to camera.
  std::optional<PlaneMap> to_camera() const {
    std::vector<PlanePair> pairs;
    for (int y = 0; y < coarse_.mean.height(); y += kCoarseStep) {
      for (int x = 0; x < coarse_.mean.width(); x += kCoarseStep) {
        if (is_white(x, y))
          pairs.push_back({{coarse_.x.at(x, y), coarse_.y.at(x, y)}, {x + 0.5, y + 0.5}});
      }
    }
    return fit_trimmed(pairs);
  }

  /// Whether that place of the projector's picture, give or take some pixels, lights that of the camera's.
  bool is_lit_from(Pixel place, Pixel seen, double within) const {
    const auto x = static_cast<int>(std::floor(seen.x));
    const auto y = static_cast<int>(std::floor(seen.y));
    return distance({coarse_.x.at(x, y), coarse_.y.at(x, y)}, place) < within;
  }

  /// Radius of the disc of white paper about a place, up to a limit; 0: there is none.
  double clear_disc(Pixel middle, double most) const {
    double radius = std::min(most, kLargestDisc);
    while (radius >= kSmallestDisc && !is_even(middle, radius + kFromPrint)) radius -= 1.0;
    return radius >= kSmallestDisc ? radius : 0.0;
  }

  /// The projected picture without the print.
  Image<std::uint8_t> without_print(const Image<float>& picture) const {
    Image<std::uint8_t> codes(picture.width(), picture.height(), 1);
    for (std::size_t i = 0; i < codes.samples().size(); ++i) {
      const float even = 2.0f * coarse_.mean.samples()[i];
      if (even < white_) continue;
      codes.samples()[i] = static_cast<std::uint8_t>(std::lround(
          std::clamp(kFullCode * picture.samples()[i] / even + 0.1f * kFullCode, 0.0f, 255.0f)));
    }
    return codes;
  }

 private:
  bool is_white(int x, int y) const {
    return coarse_.mean.at(x, y) >= white_ && std::isfinite(coarse_.x.at(x, y)) &&
           std::isfinite(coarse_.y.at(x, y));
  }

  bool is_even(Pixel middle, double radius) const {
    const auto whole = [](double v) { return static_cast<int>(std::floor(v)); };
    if (!(middle.x >= radius && middle.y >= radius &&
          middle.x < coarse_.mean.width() - radius - 1.0 &&
          middle.y < coarse_.mean.height() - radius - 1.0))
      return false;
    float least = coarse_.mean.at(whole(middle.x), whole(middle.y));
    float most = least;
    for (int y = whole(middle.y - radius); y <= whole(middle.y + radius); ++y) {
      for (int x = whole(middle.x - radius); x <= whole(middle.x + radius); ++x) {
        if (std::hypot(x + 0.5 - middle.x, y + 0.5 - middle.y) > radius) continue;
        least = std::min(least, coarse_.mean.at(x, y));
        most = std::max(most, coarse_.mean.at(x, y));
      }
    }
    return least >= white_ && least >= kEven * most;
  }

  const ProjectorMap& coarse_;
  float white_ = 0.0f;
};

struct Found {
  std::vector<PlanePair> pairs;  // camera to projector
  std::size_t room = 0;          // corners that the print leaves room for
};

Found find_corners(const Paper& paper,
                   const PlaneMap& to_camera,
                   const ProjectedBoards& boards,
                   int picture,
                   const Image<float>& seen) {
  const int square = boards.square_px(picture);
  const int offset = boards.offset_px(picture);
  const Image<std::uint8_t> grey = paper.without_print(seen);
  Found found;
  for (int j = 1; offset + j * square < boards.height; ++j) {
    for (int i = 1; offset + i * square < boards.width; ++i) {
      const Pixel place{static_cast<double>(offset + i * square),
                        static_cast<double>(offset + j * square)};
      const Pixel guess = to_camera(place);
      const Pixel right = to_camera({place.x + 0.5 * square, place.y});
      const Pixel below = to_camera({place.x, place.y + 0.5 * square});
      const double spacing = 2.0 * std::min(distance(guess, right), distance(guess, below));
      const double radius = paper.clear_disc(guess, kDiscShare * spacing);
      if (radius == 0.0 || !paper.is_lit_from(place, guess, square)) continue;
      ++found.room;
      const auto corner = fit_corner(grey,
                                     {guess,
                                      std::atan2(right.y - guess.y, right.x - guess.x),
                                      std::atan2(below.y - guess.y, below.x - guess.x),
                                      kBlur},
                                     radius);
      const bool upper_left_is_lit = (i + j) % 2 == 0;
      if (corner && (corner->step < 0.0) == upper_left_is_lit)
        found.pairs.push_back({corner->place, place});
    }
  }
  return found;
}

bool lies_among(Pixel p, const std::vector<PlanePair>& pairs) {
  std::array<bool, 4> sides{};
  for (const PlanePair& pair : pairs)
    sides[(pair.from.x > p.x ? 1U : 0U) + (pair.from.y > p.y ? 2U : 0U)] = true;
  return std::ranges::count(sides, true) == 4;
}

std::string carry_corners(std::vector<PlanePair> pairs,
                          const BoardView& camera_view,
                          std::vector<BoardCorner>& corners) {
  const std::size_t found = pairs.size();
  const auto map = fit_trimmed(pairs);
  if (!map) return fmt::format("{} projected corners found; {} are needed", found, kFewestPairs);
  if (const double scatter = map->scatter(pairs); scatter > kScatters)
    return fmt::format("projected corners scatter by {:.2f} px: is the board flat?", scatter);
  for (const BoardCorner& corner : camera_view.corners) {
    if (lies_among(corner.pixel, pairs)) corners.push_back({corner.id, (*map)(corner.pixel)});
  }
  if (static_cast<int>(corners.size()) < kFewestCornersSeen)
    return fmt::format("projected corners surround {} of {} printed ones",
                       corners.size(),
                       camera_view.corners.size());
  return {};
}

}  // namespace

int ProjectedBoards::square_px(int picture) const {
  return std::max(width, height) / kSquaresAcross + picture / 2;
}

int ProjectedBoards::offset_px(int picture) const {
  return picture % 2 == 0 ? 0 : square_px(picture) / 2;
}

PhasePlan coarse_plan(PhasePlan plan) {
  plan.shares.resize(1);
  return plan;
}

Image<std::uint8_t> projected_board(const ProjectedBoards& boards, int picture) {
  const int square = boards.square_px(picture);
  const int before = square - boards.offset_px(picture);  // of square (-1, -1) out of the picture
  Image<std::uint8_t> codes(boards.width, boards.height, 1);
  for (int y = 0; y < boards.height; ++y) {
    for (int x = 0; x < boards.width; ++x) {
      if (((x + before) / square + (y + before) / square) % 2 == 0) codes.at(x, y) = boards.white;
    }
  }
  return codes;
}

BoardView projector_view(const ProjectorMap& coarse,
                         const ProjectedBoards& boards,
                         std::span<const Image<float>> pictures,
                         const BoardView& camera_view) {
  BoardView view;
  view.name = camera_view.name;
  view.fault = camera_view.fault;
  if (!view.fault.empty()) return view;
  const Paper paper(coarse);
  const auto to_camera = paper.to_camera();
  if (!to_camera) {
    view.fault = "too little of the projector's light on white paper";
    return view;
  }
  std::vector<PlanePair> pairs;
  for (int k = 0; k < boards.pictures; ++k) {
    const Found found =
        find_corners(paper, *to_camera, boards, k, pictures[static_cast<std::size_t>(k)]);
    if (static_cast<double>(found.pairs.size()) < kLeastFound * static_cast<double>(found.room)) {
      view.fault = fmt::format(
          "projected chessboard {}: {} of {} corners are where the coarse code says; is the "
          "projector's gamma as measured, and is it in focus?",
          k + 1,
          found.pairs.size(),
          found.room);
      return view;
    }
    pairs.insert(pairs.end(), found.pairs.begin(), found.pairs.end());
  }
  view.fault = carry_corners(std::move(pairs), camera_view, view.corners);
  return view;
}

}  // namespace opaline::calibration
