#include "sim/board_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "sim/sensor.h"

namespace opaline::sim {
namespace {

constexpr int kMarkerCells = 6;  // four of bits and a black border
constexpr double kDistance = 350.0;
constexpr double kLeastTilt = 15.0 * std::numbers::pi / 180.0;
constexpr double kMostTilt = 40.0 * std::numbers::pi / 180.0;
constexpr int kTries = 2000;
constexpr double kInside = 4.0;  // px

// DICT_4X4_50: sixteen bits of each marker, row by row from the upper left, 1 is white.
constexpr std::array<std::uint16_t, 50> kMarkers{
    0xb532, 0x0f9a, 0x332d, 0x9946, 0x549e, 0x79cd, 0x9e2e, 0xc4f2, 0xfeda, 0xcf56,
    0xf991, 0x11a7, 0x0eb7, 0x2a0f, 0x24b1, 0x263e, 0x4665, 0x6600, 0x6c5e, 0x76af,
    0x868b, 0xb02b, 0xccd5, 0xdd82, 0xfe47, 0x9471, 0xace4, 0xa554, 0x2123, 0x346f,
    0x4415, 0x57b2, 0x9ecf, 0xf0cb, 0x08ae, 0x0929, 0x1875, 0x04ff, 0x0df6, 0x1c5a,
    0x1718, 0x2a28, 0x328c, 0x38b2, 0x24e8, 0x2eeb, 0x2d3f, 0x4b64, 0x502e, 0x5013};

// -1 on one side of the nearest line between squares, 1 on the other, with a ramp between.
double side(double place, double square, double footprint, int squares) {
  const double in_squares = place / square;
  const double line = std::clamp(std::round(in_squares), 1.0, squares - 1.0);
  const double ramp = std::clamp((in_squares - line) * square / (0.5 * footprint), -1.0, 1.0);
  return static_cast<int>(line) % 2 == 0 ? -ramp : ramp;
}

bool marker_is_black(const SimBoard& board, double x, double y) {
  const int column = static_cast<int>(x / board.square_mm);
  const int row = static_cast<int>(y / board.square_mm);
  if ((column + row) % 2 == 0) return false;
  int before = 0;  // white squares of the rows above and to the left
  for (int r = 0; r <= row; ++r) {
    const int until = r == row ? column : board.squares_x;
    before += (until + (r % 2 == 0 ? 0 : 1)) / 2;
  }
  const double edge = 0.5 * (board.square_mm - board.marker_mm);
  const double cell = board.marker_mm / kMarkerCells;
  const double i = std::floor((x - column * board.square_mm - edge) / cell);
  const double j = std::floor((y - row * board.square_mm - edge) / cell);
  if (i < 0.0 || j < 0.0 || i >= kMarkerCells || j >= kMarkerCells) return false;
  if (i < 1.0 || j < 1.0 || i > 4.0 || j > 4.0) return true;
  const int bit = 15 - (4 * (static_cast<int>(j) - 1) + static_cast<int>(i) - 1);
  return ((kMarkers[static_cast<std::size_t>(before) % kMarkers.size()] >> bit) & 1) == 0;
}

Pose turned(double tilt, double about, double spin, Vec3 middle, const SimBoard& board) {
  const double ax = std::cos(about);
  const double ay = std::sin(about);
  const double c = std::cos(tilt);
  const double s = std::sin(tilt);
  const std::array<double, 9> r{c + ax * ax * (1 - c),
                                ax * ay * (1 - c),
                                ay * s,
                                ax * ay * (1 - c),
                                c + ay * ay * (1 - c),
                                -ax * s,
                                -ay * s,
                                ax * s,
                                c};
  const double cs = std::cos(spin);
  const double ss = std::sin(spin);
  Pose pose;
  for (std::size_t i = 0; i < 3; ++i) {
    pose.rotation[3 * i] = r[3 * i] * cs + r[3 * i + 1] * ss;
    pose.rotation[3 * i + 1] = -r[3 * i] * ss + r[3 * i + 1] * cs;
    pose.rotation[3 * i + 2] = r[3 * i + 2];
  }
  pose.translation = middle - pose.rotate({0.5 * board.width_mm(), 0.5 * board.height_mm(), 0.0});
  return pose;
}

bool is_wholly_seen(const SimBoard& board, const CameraModel& lens, const Pose& sample_from_board) {
  const double m = board.margin_mm;
  for (const double x : {-m, board.width_mm() + m}) {
    for (const double y : {-m, board.height_mm() + m}) {
      const Vec3 corner = sample_from_board.apply({x, y, 0.0});
      if (!lens.faces(corner)) return false;
      const auto p = lens.project(corner);
      if (p.x < kInside || p.y < kInside || p.x > lens.width - kInside ||
          p.y > lens.height - kInside)
        return false;
    }
  }
  return true;
}

}  // namespace

double SimBoard::albedo(double x_mm, double y_mm, double footprint_mm) const {
  const double w = width_mm();
  const double h = height_mm();
  if (x_mm < -margin_mm || y_mm < -margin_mm || x_mm > w + margin_mm || y_mm > h + margin_mm)
    return 0.0;
  if (x_mm < 0.0 || y_mm < 0.0 || x_mm >= w || y_mm >= h) return white;
  if (kind == SimBoardKind::kCharuco && marker_is_black(*this, x_mm, y_mm)) return black;
  const double alike = side(x_mm, square_mm, footprint_mm, squares_x) *
                       side(y_mm, square_mm, footprint_mm, squares_y);
  return 0.5 * (white + black) - 0.5 * (white - black) * alike;
}

bool SeenFace::holds(Vec3 eye, Vec3 ray) const {
  const auto along = [](Vec3 v, int axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; };
  const int normal = axis_of(face);
  const Vec3 size = block.size();
  const double at = is_max(face) ? along(size, normal) : 0.0;
  const double t = (at - along(eye, normal)) / along(ray, normal);
  const Vec3 hit = eye + ray * t;
  for (int axis = 0; axis < 3; ++axis) {
    if (axis != normal && !(along(hit, axis) >= 0.0 && along(hit, axis) <= along(size, axis)))
      return false;
  }
  return t > 0.0;
}

Result<void> validate(const BoardSceneOptions& options) {
  const SimBoard& board = options.board;
  if (board.squares_x < 3 || board.squares_y < 3 || !(board.square_mm > 0.0))
    return invalid_argument(fmt::format("board of {} x {} squares of {} mm; expected 3 x 3 or more",
                                        board.squares_x,
                                        board.squares_y,
                                        board.square_mm));
  if (options.poses.empty()) return invalid_argument("board: no pose");
  if (options.projector.width < 1 || !(options.projector.fx > 0.0))
    return invalid_argument("board: the projector has no lens");
  return ok();
}

CameraModel board_camera(int width, int height) {
  CameraModel lens;
  lens.width = width;
  lens.height = height;
  lens.fx = 1.372 * width;
  lens.fy = 1.375 * width;
  lens.cx = 0.5 * width + 0.011 * width;
  lens.cy = 0.5 * height - 0.008 * width;
  lens.distortion = {-0.12, 0.06, 0.0007, -0.0005, -0.01};
  return lens;
}

CameraModel board_projector(int width, int height, double baseline_mm) {
  CameraModel lens;
  lens.width = width;
  lens.height = height;
  lens.fx = 1.21 * width;
  lens.fy = 1.212 * width;
  lens.cx = 0.493 * width;
  lens.cy = 0.52 * height;
  lens.distortion = {0.05, -0.03, -0.0004, 0.0006, 0.0};
  lens.camera_from_sample = look_at({baseline_mm, 0.0, 0.0}, {0.0, 0.0, kDistance}, {0, -1, 0});
  return lens;
}

std::vector<SimBoardPose> held_poses(const SimBoard& board,
                                     const CameraModel& camera,
                                     const CameraModel& projector,
                                     double distance_mm,
                                     int count,
                                     std::uint64_t seed) {
  std::vector<SimBoardPose> poses;
  const Pose sample_from_camera = camera.camera_from_sample.inverse();
  for (int i = 0; i < count; ++i) {
    for (int attempt = 0; attempt < kTries; ++attempt) {
      std::uint64_t key =
          mix(mix(seed, static_cast<std::uint64_t>(i)), static_cast<std::uint64_t>(attempt));
      const auto draw = [&key] {
        key = mix(key, 1);
        return uniform(key);
      };
      const double z = distance_mm * (0.8 + 0.45 * draw());
      const double x = z * (camera.width * (0.15 + 0.7 * draw()) - camera.cx) / camera.fx;
      const double y = z * (camera.height * (0.15 + 0.7 * draw()) - camera.cy) / camera.fy;
      const double tilt = kLeastTilt + (kMostTilt - kLeastTilt) * draw();
      const double about = 2.0 * std::numbers::pi * (i * 0.382 + 0.1 * draw());
      const double spin = 0.5 * (draw() - 0.5) + (i % 3 == 1 ? 0.5 * std::numbers::pi : 0.0);
      Pose pose = turned(tilt, about, spin, {x, y, z}, board);
      Pose world;
      for (std::size_t r = 0; r < 3; ++r) {
        for (std::size_t c = 0; c < 3; ++c) {
          world.rotation[3 * r + c] =
              sample_from_camera.rotation[3 * r] * pose.rotation[c] +
              sample_from_camera.rotation[3 * r + 1] * pose.rotation[3 + c] +
              sample_from_camera.rotation[3 * r + 2] * pose.rotation[6 + c];
        }
      }
      world.translation = sample_from_camera.apply(pose.translation);
      if (!is_wholly_seen(board, camera, world) || !is_wholly_seen(board, projector, world))
        continue;
      poses.push_back({world});
      break;
    }
  }
  return poses;
}

}  // namespace opaline::sim
