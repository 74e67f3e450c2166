#include "calibration/pose_taker.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string_view>
#include <utility>

#include "calibration/board_finder.h"
#include "calibration/projected_boards.h"

namespace opaline::calibration {
namespace {

constexpr double kTooBright = 0.90;  // of the highest code
constexpr double kDimmedTo = 0.75;   // of the light
constexpr int kDimmings = 8;
constexpr double kFew = 0.002;              // of pixels, may be full
constexpr double kLeastModulation = 0.004;  // of the range

Image<float> grey_light(const Frame& frame, std::span<const double> linear) {
  Image<float> grey(frame.pixels.width(), frame.pixels.height(), 1);
  const auto codes = frame.pixels.samples();
  for (std::size_t i = 0; i < codes.size(); ++i)
    grey.samples()[i / 3] += static_cast<float>(linear[codes[i]] / 3.0);
  return grey;
}

bool is_too_bright(const Frame& frame, double highest) {
  const auto codes = frame.pixels.samples();
  const auto full =
      std::ranges::count_if(codes, [&](std::uint16_t code) { return code > kTooBright * highest; });
  return static_cast<double>(full) > kFew * static_cast<double>(codes.size());
}

Image<std::uint8_t> even(const FrameTaker& taker, std::uint8_t code) {
  return {taker.projector().width, taker.projector().height, 1, code};
}

struct White {
  Frame frame;
  std::uint8_t code = 255;
};

// The brightest even light under which next to nothing is full.
Result<White> take_white(StepContext& context, const std::string& name, const Brightness& from) {
  const double highest = linear_camera(context).max_code();
  const double gamma = context.record.measured.projector_gamma.value_or(1.0);
  double code = from.light[0];
  for (int dimming = 0;; ++dimming) {
    const auto now = static_cast<std::uint8_t>(std::lround(code));
    auto frame = context.taker.pictured(even(context.taker, now), name, from.turns, context.stop);
    if (!frame) return frame.error();
    if (dimming == kDimmings || !is_too_bright(*frame, highest))
      return White{*std::move(frame), now};
    code *= std::pow(kDimmedTo, 1.0 / gamma);
  }
}

PhasePlan plan_of(const StepContext& context, std::uint8_t white) {
  PhasePlan plan;
  plan.width = context.taker.projector().width;
  plan.height = context.taker.projector().height;
  plan.gamma = context.record.measured.projector_gamma.value_or(plan.gamma);
  plan.white = white;
  return plan;
}

/// What a pose's camera sees of the projector's patterns, linear and grey.
class PatternTaker {
 public:
  PatternTaker(StepContext& context, const std::string& name, std::uint8_t white, int turns)
      : context_(context),
        name_(name),
        white_(white),
        turns_(turns),
        linear_(linear_codes(linear_camera(context))) {}

  Result<ProjectorMap> take_phases(const PhasePlan& plan) const {
    const auto pictures =
        take("phase", plan.count(), [&](int i) { return phase_pattern(plan, i); });
    if (!pictures) return pictures.error();
    const CodeRange range = code_range(context_);
    return decode_phases(plan,
                         *pictures,
                         kLeastModulation * (linear_[static_cast<std::size_t>(range.clipping)] -
                                             linear_[static_cast<std::size_t>(range.black)]));
  }

  /// The patterns' mean, and where the projector sees the corners that the camera sees in it.
  struct Answer {
    Image<float> mean;
    std::function<BoardView(const BoardView&)> projector_view;
  };
  Result<Answer> take_all() const {
    const PhasePlan plan = plan_of(context_, white_);
    if (context_.geometry.projected == GeometryOptions::Projected::kChessboards)
      return take_boards(coarse_plan(plan));
    auto map = take_phases(plan);
    if (!map) return map.error();
    Image<float> mean = map->mean;
    return Answer{std::move(mean),
                  [map = *std::move(map), board = context_.geometry.board](const BoardView& view) {
                    return projector_view(map, view, board);
                  }};
  }

 private:
  Result<Answer> take_boards(const PhasePlan& plan) const {
    auto map = take_phases(plan);
    if (!map) return map.error();
    const ProjectedBoards boards{plan.width, plan.height, white_};
    auto pictures = take(
        "projected chessboard", boards.pictures, [&](int k) { return projected_board(boards, k); });
    if (!pictures) return pictures.error();
    Image<float> mean = map->mean;
    return Answer{
        std::move(mean),
        [map = *std::move(map), boards, pictures = *std::move(pictures)](const BoardView& view) {
          return projector_view(map, boards, pictures, view);
        }};
  }

  Result<std::vector<Image<float>>> take(
      std::string_view what,
      int count,
      const std::function<Image<std::uint8_t>(int)>& pattern) const {
    std::vector<Image<float>> pictures;
    for (int i = 0; i < count; ++i) {
      const auto frame = context_.taker.pictured(
          pattern(i), fmt::format("{}, {} {}", name_, what, i + 1), turns_, context_.stop);
      if (!frame) return frame.error();
      pictures.push_back(grey_light(*frame, linear_));
    }
    return pictures;
  }

  StepContext& context_;
  const std::string& name_;
  std::uint8_t white_;
  int turns_;
  std::vector<double> linear_;
};

}  // namespace

std::optional<double> corners_moved(const BoardView& before, const BoardView& after) {
  std::vector<double> distances;
  for (const BoardCorner& corner : before.corners) {
    const auto same = std::ranges::find(after.corners, corner.id, &BoardCorner::id);
    if (same == after.corners.end()) continue;
    distances.push_back(std::hypot(same->pixel.x - corner.pixel.x, same->pixel.y - corner.pixel.y));
  }
  if (distances.empty()) return std::nullopt;
  const auto middle = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2);
  std::ranges::nth_element(distances, middle);
  return *middle;
}

Result<PosePair> take_pose(StepContext& context,
                           const std::string& name,
                           const Brightness& brightness) {
  const Board& board = context.geometry.board;
  const auto white = take_white(context, name, brightness);
  if (!white) return white.error();
  Image<std::uint8_t> grey = grey_of(white->frame.pixels);
  auto before = find_board(grey, board, name);
  if (!before) return before.error();
  if (!before->fault.empty()) return PosePair{*before, *before, std::move(grey), {}};
  const auto patterns = PatternTaker(context, name, white->code, brightness.turns).take_all();
  if (!patterns) return patterns.error();
  const auto last = context.taker.pictured(
      even(context.taker, white->code), name, brightness.turns, context.stop);
  if (!last) return last.error();
  const auto after = find_board(grey_of(last->pixels), board, name);
  if (!after) return after.error();
  grey = grey_of(patterns->mean);
  auto camera = find_board(grey, board, name);
  if (!camera) return camera.error();
  const double moved = corners_moved(*before, *after).value_or(0.0);
  if (!after->fault.empty() || moved > kMayMove)
    camera->fault = fmt::format("moved board: by {:.2f} px while the patterns were shown", moved);
  PosePair pose{*std::move(camera), {}, std::move(grey), {}};
  pose.projector = patterns->projector_view(pose.camera);
  pose.paper = paper_light(patterns->mean, pose.camera, board);
  return pose;
}

}  // namespace opaline::calibration
