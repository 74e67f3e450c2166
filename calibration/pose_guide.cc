#include "calibration/pose_guide.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "calibration/zhang.h"

namespace opaline::calibration {
namespace {

constexpr double kDegrees = 180.0 / std::numbers::pi;
constexpr double kDistancesDiffer = 1.2;
constexpr int kEnoughForDistance = 4;
constexpr int kThirds = 3;

int field_of(double place, int size, int count) {
  return std::clamp(static_cast<int>(place / size * count), 0, count - 1);
}

void count_fields(PoseGuide& guide, int width, int height, const BoardView& view) {
  for (const BoardCorner& corner : view.corners) {
    const int x = field_of(corner.pixel.x, width, PoseGuide::kAcross);
    const int y = field_of(corner.pixel.y, height, PoseGuide::kDown);
    ++guide.fields[static_cast<std::size_t>(y * PoseGuide::kAcross + x)];
  }
}

void count_tilt(PoseGuide& guide, const PoseLie& lie) {
  if (lie.tilt_deg() < PoseGuide::kLeastTilt) {
    ++guide.flat;
  } else if (std::abs(lie.right_deg) >= std::abs(lie.down_deg)) {
    ++(lie.right_deg > 0.0 ? guide.right_nearer : guide.left_nearer);
  } else {
    ++(lie.down_deg > 0.0 ? guide.bottom_nearer : guide.top_nearer);
  }
}

// The ninth of the picture with the fewest corners.
std::string place_wish(int width, int height, std::span<const BoardView> views) {
  constexpr std::array<const char*, std::size_t{kThirds} * kThirds> kNames{"the upper left",
                                                                           "the top",
                                                                           "the upper right",
                                                                           "the left",
                                                                           "the middle",
                                                                           "the right",
                                                                           "the lower left",
                                                                           "the bottom",
                                                                           "the lower right"};
  std::array<int, kNames.size()> counts{};
  for (const BoardView& view : views) {
    if (!view.fault.empty()) continue;
    for (const BoardCorner& corner : view.corners) {
      ++counts[static_cast<std::size_t>(kThirds * field_of(corner.pixel.y, height, kThirds) +
                                        field_of(corner.pixel.x, width, kThirds))];
    }
  }
  return kNames[static_cast<std::size_t>(std::ranges::min_element(counts) - counts.begin())];
}

std::string tilt_wish(const PoseGuide& guide) {
  const std::array<std::pair<int, const char*>, 4> ways{{{guide.left_nearer, "left"},
                                                         {guide.top_nearer, "upper"},
                                                         {guide.right_nearer, "right"},
                                                         {guide.bottom_nearer, "lower"}}};
  return std::ranges::min_element(ways, {}, &std::pair<int, const char*>::first)->second;
}

std::string distance_wish(const PoseGuide& guide) {
  const bool alike = guide.farthest_mm < kDistancesDiffer * guide.nearest_mm;
  return guide.poses >= kEnoughForDistance && alike ? ", and a third closer or farther" : "";
}

}  // namespace

double PoseLie::tilt_deg() const {
  const double x = std::tan(right_deg / kDegrees);
  const double y = std::tan(down_deg / kDegrees);
  return kDegrees * std::atan(std::hypot(x, y));
}

// The plane n (p - t) = 0: its depth falls by n_x / n_z along a row.
PoseLie lie_of(const Pose& camera_from_board, const Board& board) {
  const Vec3 n = camera_from_board.rotate({0.0, 0.0, 1.0});
  const Vec3 middle{
      0.5 * board.squares_x * board.square_mm, 0.5 * board.squares_y * board.square_mm, 0.0};
  return {kDegrees * std::atan2(n.x, std::abs(n.z)),
          kDegrees * std::atan2(n.y, std::abs(n.z)),
          length(camera_from_board.apply(middle))};
}

PoseGuide guide_poses(int width, int height, const Board& board, std::span<const BoardView> views) {
  PoseGuide guide;
  guide.lies.resize(views.size());
  std::vector<Homography> planes;
  std::vector<std::size_t> of;
  for (std::size_t v = 0; v < views.size(); ++v) {
    if (!views[v].fault.empty()) continue;
    count_fields(guide, width, height, views[v]);
    const auto plane = board_homography(board, views[v]);
    if (!plane) continue;
    planes.push_back(*plane);
    of.push_back(v);
  }
  const CameraModel lens = initial_lens(width, height, planes);
  for (std::size_t i = 0; i < planes.size(); ++i) {
    const PoseLie lie = lie_of(initial_pose(lens, planes[i]), board);
    guide.lies[of[i]] = lie;
    count_tilt(guide, lie);
    guide.nearest_mm = i == 0 ? lie.distance_mm : std::min(guide.nearest_mm, lie.distance_mm);
    guide.farthest_mm = std::max(guide.farthest_mm, lie.distance_mm);
  }
  guide.poses = static_cast<int>(planes.size());
  guide.coverage =
      static_cast<double>(guide.fields.size() -
                          static_cast<std::size_t>(std::ranges::count(guide.fields, 0))) /
      static_cast<double>(guide.fields.size());
  guide.wish = fmt::format("towards {}, its {} edge 15 to 40 degrees nearer{}",
                           place_wish(width, height, views),
                           tilt_wish(guide),
                           distance_wish(guide));
  return guide;
}

}  // namespace opaline::calibration
