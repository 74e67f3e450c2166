#include "calibration/board_finder.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/aruco/charuco.hpp>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <vector>

#include "calibration/corner_model.h"

namespace opaline::calibration {
namespace {

constexpr int kMostSquares = 100;
constexpr double kIgnored = 0.001;  // of samples, at either end of the range
constexpr int kRefineSteps = 60;
constexpr double kRefined = 1e-4;     // px
constexpr double kWindowShare = 0.3;  // of the corners' distance
constexpr double kClear = 0.9;        // of the paper between a square's edge and its marker
constexpr double kClearOfBlur = 0.5;
constexpr int kLargestWindow = 11;
constexpr double kDiscShare = 0.45;    // of the corners' distance
constexpr double kSmallestDisc = 3.0;  // px
constexpr double kLargestDisc = 14.0;
constexpr int kFewestCorners = 8;
constexpr double kProfileShare = 0.45;
constexpr double kProfileStep = 0.25;

using Points = std::vector<cv::Point2f>;

struct Found {
  Points points;
  std::vector<int> ids;
};

std::optional<Found> find_chessboard(const cv::Mat& picture, const Board& board) {
  const cv::Size size(board.columns(), board.rows());
  Found found;
  const int flags = cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_EXHAUSTIVE | cv::CALIB_CB_ACCURACY;
  if (!cv::findChessboardCornersSB(picture, size, found.points, flags) &&
      !cv::findChessboardCorners(
          picture,
          size,
          found.points,
          cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_FAST_CHECK)) {
    return std::nullopt;
  }
  for (int id = 0; id < board.corner_count(); ++id) found.ids.push_back(id);
  return found;
}

cv::Ptr<cv::aruco::CharucoBoard> charuco_board(const Board& board) {
  return cv::aruco::CharucoBoard::create(
      board.squares_x,
      board.squares_y,
      static_cast<float>(board.square_mm),
      static_cast<float>(board.marker_mm),
      cv::aruco::getPredefinedDictionary(cv::aruco::DICT_4X4_50));
}

std::optional<Found> find_charuco(const cv::Mat& picture, const Board& board) {
  const auto charuco = charuco_board(board);
  std::vector<Points> markers;
  std::vector<int> marker_ids;
  cv::aruco::detectMarkers(picture, charuco->dictionary, markers, marker_ids);
  if (markers.empty()) return std::nullopt;
  Found found;
  cv::aruco::interpolateCornersCharuco(
      markers, marker_ids, picture, charuco, found.points, found.ids);
  if (found.ids.empty()) return std::nullopt;
  return found;
}

// The shortest distance of neighbours in a row or column, px.
double spacing_of(const Found& found, const Board& board) {
  double least = 1e9;
  for (std::size_t a = 0; a < found.ids.size(); ++a) {
    for (std::size_t b = 0; b < a; ++b) {
      const int apart = std::abs(found.ids[a] - found.ids[b]);
      if (apart == 1 || apart == board.columns())
        least = std::min(least, cv::norm(found.points[a] - found.points[b]));
    }
  }
  return least;
}

// How far from an edge there is nothing but it, over the corners' distance.
double clear_of(const Board& board, double most, double clear) {
  if (board.kind == Board::Kind::kChessboard) return most;
  return std::min(most, 0.5 * clear * (1.0 - board.marker_mm / board.square_mm));
}

void refine(const cv::Mat& picture, double clear, Points& points) {
  const int half = std::clamp(static_cast<int>(clear), 2, kLargestWindow);
  cv::cornerSubPix(picture,
                   points,
                   {half, half},
                   {-1, -1},
                   {cv::TermCriteria::EPS + cv::TermCriteria::COUNT, kRefineSteps, kRefined});
}

// The direction from one neighbour to the other, or to the corner itself where it is the last.
std::optional<double> edge_angle(const Found& found, std::size_t corner, int before, int after) {
  const auto at = [&](int id) {
    const auto there = std::ranges::find(found.ids, id);
    return there == found.ids.end()
               ? found.points[corner]
               : found.points[static_cast<std::size_t>(there - found.ids.begin())];
  };
  const cv::Point2f along = at(after) - at(before);
  if (cv::norm(along) < 1.0) return std::nullopt;
  return std::atan2(along.y, along.x);
}

// Where the picture holds what corner_model.h says of corners, by that.
void model_corners(const Image<std::uint8_t>& grey,
                   const Board& board,
                   double radius,
                   double blur_px,
                   Found& found) {
  const Found before = found;
  for (std::size_t i = 0; i < found.ids.size(); ++i) {
    const int id = found.ids[i];
    const int column = id % board.columns();
    const auto along =
        edge_angle(before, i, column > 0 ? id - 1 : id, column + 1 < board.columns() ? id + 1 : id);
    const auto across = edge_angle(before, i, id - board.columns(), id + board.columns());
    if (!along || !across) continue;
    const CameraModel::Pixel place{found.points[i].x + 0.5, found.points[i].y + 0.5};
    const auto corner = fit_corner(grey, {place, *along, *across, blur_px}, radius);
    if (!corner) continue;
    found.points[i] = {static_cast<float>(corner->place.x - 0.5),
                       static_cast<float>(corner->place.y - 0.5)};
  }
}

double sample(const cv::Mat& picture, double x, double y) {
  const int i = std::clamp(static_cast<int>(std::floor(x)), 0, picture.cols - 2);
  const int j = std::clamp(static_cast<int>(std::floor(y)), 0, picture.rows - 2);
  const double u = std::clamp(x - i, 0.0, 1.0);
  const double v = std::clamp(y - j, 0.0, 1.0);
  const auto at = [&](int column, int row) -> double {
    return picture.at<std::uint8_t>(row, column);
  };
  return (1.0 - v) * ((1.0 - u) * at(i, j) + u * at(i + 1, j)) +
         v * ((1.0 - u) * at(i, j + 1) + u * at(i + 1, j + 1));
}

struct Edge {
  double variance = 0.0;  // of the place of its slope, px^2
  double contrast = 0.0;
};

// The profile across the edge that two neighbouring corners end.
std::optional<Edge> edge_between(const cv::Mat& picture,
                                 cv::Point2f a,
                                 cv::Point2f b,
                                 double share) {
  const cv::Point2f along = b - a;
  const double span = cv::norm(along);
  const double nx = -along.y / span;
  const double ny = along.x / span;
  const double reach = share * span;
  double weight = 0.0;
  double first = 0.0;
  double second = 0.0;
  const double mx = 0.5 * (a.x + b.x);
  const double my = 0.5 * (a.y + b.y);
  const int steps = static_cast<int>(std::ceil(2.0 * reach / kProfileStep));
  for (int n = 0; n < steps; ++n) {
    const double s = n * kProfileStep - reach;
    const double from = sample(picture, mx + s * nx, my + s * ny);
    const double to = sample(picture, mx + (s + kProfileStep) * nx, my + (s + kProfileStep) * ny);
    const double place = s + 0.5 * kProfileStep;
    weight += to - from;
    first += (to - from) * place;
    second += (to - from) * place * place;
  }
  if (std::abs(weight) < 10.0) return std::nullopt;
  const double mean = first / weight;
  return Edge{second / weight - mean * mean, std::abs(weight)};
}

void measure_edges(const cv::Mat& picture,
                   const Board& board,
                   const Found& found,
                   BoardView& view) {
  std::vector<double> variances;
  std::vector<double> contrasts;
  for (std::size_t a = 0; a < found.ids.size(); ++a) {
    for (std::size_t b = 0; b < found.ids.size(); ++b) {
      const int apart = found.ids[b] - found.ids[a];
      const bool is_beside = apart == 1 && found.ids[b] % board.columns() != 0;
      if (!is_beside && apart != board.columns()) continue;
      const auto edge = edge_between(
          picture, found.points[a], found.points[b], clear_of(board, kProfileShare, kClearOfBlur));
      if (!edge) continue;
      variances.push_back(edge->variance);
      contrasts.push_back(edge->contrast);
    }
  }
  if (variances.empty()) return;
  const auto median = [](std::vector<double>& values) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::ranges::nth_element(values, middle);
    return *middle;
  };
  view.blur_px = std::sqrt(std::max(0.0, median(variances)));
  view.contrast = median(contrasts);
}

BoardView view_of(const Image<std::uint8_t>& grey, const Board& board, const std::string& name) {
  cv::Mat picture(grey.height(), grey.width(), CV_8UC1);
  std::ranges::copy(grey.samples(), picture.begin<std::uint8_t>());
  BoardView view;
  view.name = name;
  const bool is_charuco = board.kind == Board::Kind::kCharuco;
  auto found = is_charuco ? find_charuco(picture, board) : find_chessboard(picture, board);
  if (!found) {
    view.fault = "no board found: hidden, out of the picture, or out of focus";
    return view;
  }
  const double spacing = spacing_of(*found, board);
  refine(picture, clear_of(board, kWindowShare, kClear) * spacing, found->points);
  measure_edges(picture, board, *found, view);
  const double disc =
      std::clamp(clear_of(board, kDiscShare, kClear) * spacing, kSmallestDisc, kLargestDisc);
  model_corners(grey, board, disc, view.blur_px, *found);
  for (std::size_t i = 0; i < found->ids.size(); ++i)
    view.corners.push_back({found->ids[i], {found->points[i].x + 0.5, found->points[i].y + 0.5}});
  if (static_cast<int>(found->ids.size()) < kFewestCorners)
    view.fault = fmt::format("only {} corners found", found->ids.size());
  return view;
}

}  // namespace

Result<void> validate(const Board& board) {
  const auto count = [](const char* name, int value) {
    return invalid_argument(
        fmt::format("board: {} = {}; expected 3 to {}", name, value, kMostSquares));
  };
  if (board.kind == Board::Kind::kNone)
    return invalid_argument("board: kind = \"none\"; expected \"chessboard\" or \"charuco\"");
  if (board.squares_x < 3 || board.squares_x > kMostSquares)
    return count("squares_x", board.squares_x);
  if (board.squares_y < 3 || board.squares_y > kMostSquares)
    return count("squares_y", board.squares_y);
  if (!(board.square_mm > 0.0))
    return invalid_argument(fmt::format("board: square = {} mm; expected > 0", board.square_mm));
  if (!(board.known_length_mm >= 0.0))
    return invalid_argument(
        fmt::format("board: known_length = {} mm; expected >= 0", board.known_length_mm));
  if (board.kind != Board::Kind::kCharuco) return ok();
  if (!(board.marker_mm > 0.0 && board.marker_mm < board.square_mm))
    return invalid_argument(
        fmt::format("board: marker = {} mm; expected more than 0 and less than "
                    "the square of {} mm",
                    board.marker_mm,
                    board.square_mm));
  if (board.squares_x * board.squares_y / 2 > 50)
    return invalid_argument(
        fmt::format("board: {} x {} squares; the dictionary has markers for 101",
                    board.squares_x,
                    board.squares_y));
  return ok();
}

Result<BoardView> find_board(const Image<std::uint8_t>& grey,
                             const Board& board,
                             const std::string& name) {
  if (auto good = validate(board); !good) return good.error();
  if (grey.empty() || grey.channels() != 1)
    return invalid_argument(fmt::format("{}: a grey picture was expected", name));
  try {
    return view_of(grey, board, name);
  } catch (const cv::Exception& e) {
    return internal_error(fmt::format("{}: OpenCV: {}", name, e.what()));
  }
}

Image<std::uint8_t> grey_of(const Image<std::uint16_t>& picture) {
  Image<float> light(picture.width(), picture.height(), picture.channels());
  std::ranges::copy(picture.samples(), light.samples().begin());
  return grey_of(light);
}

Image<std::uint8_t> grey_of(const Image<float>& picture) {
  const auto channels = static_cast<std::size_t>(picture.channels());
  std::vector<float> sum(picture.pixel_count());
  for (std::size_t i = 0; i < picture.samples().size(); ++i)
    sum[i / channels] += picture.samples()[i];
  Image<std::uint8_t> grey(picture.width(), picture.height(), 1);
  if (sum.empty()) return grey;
  std::vector<float> sorted = sum;
  const auto ignored = static_cast<std::ptrdiff_t>(kIgnored * static_cast<double>(sorted.size()));
  const auto low = sorted.begin() + ignored;
  std::ranges::nth_element(sorted, low);
  const float dark = *low;
  const auto high = sorted.end() - 1 - ignored;
  std::ranges::nth_element(sorted, high);
  const float scale = *high > dark ? 255.0f / (*high - dark) : 0.0f;
  for (std::size_t i = 0; i < sum.size(); ++i) {
    grey.samples()[i] =
        static_cast<std::uint8_t>(std::lround(std::clamp((sum[i] - dark) * scale, 0.0f, 255.0f)));
  }
  return grey;
}

}  // namespace opaline::calibration
