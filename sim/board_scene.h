#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "base/block.h"
#include "base/camera_model.h"
#include "base/pose.h"
#include "base/result.h"

namespace opaline::sim {

enum class SimBoardKind : std::uint8_t { kChessboard, kCharuco };

/// A board as it truly is: matt paper in the plane z = 0 of its frame, x along its rows, y down, from (0, 0) in its upper left
/// corner, z away from whoever looks at it. The squares alternate, black in the upper left corner; of kCharuco the white ones
/// hold the ArUco markers 0, 1, 2, ... of DICT_4X4_50 in order. Around it lies a white margin.
struct SimBoard {
  SimBoardKind kind = SimBoardKind::kChessboard;
  int squares_x = 10;
  int squares_y = 7;
  double square_mm = 20.0;
  double marker_mm = 15.0;
  double margin_mm = 10.0;
  double white = 0.8;   ///< albedo
  double black = 0.05;  ///< of ink

  double width_mm() const { return squares_x * square_mm; }
  double height_mm() const { return squares_y * square_mm; }
  /// Albedo at a place, mean over a square of the given width about it; 0 beside the paper. Within half that width of an edge
  /// between squares it goes linearly from one to the other.
  double albedo(double x_mm, double y_mm, double footprint_mm) const;
};

/// Where a board is held, and what is wrong with how.
struct SimBoardPose {
  Pose sample_from_board;
  double defocus_px = 0.0;  ///< more blur than the lens's own, standard deviation in camera pixels
  double hidden = 0.0;      ///< share of the board's width, from the right, that a hand covers
};

/// A face of a sample that is seen in place of what lies around it.
struct SeenFace {
  Block block;
  Face face = Face::kZMax;

  /// Whether a ray, in the sample's frame, meets it.
  bool holds(Vec3 eye, Vec3 ray) const;
};

/// What a simulated operator shows a camera and a projector.
struct BoardSceneOptions {
  SimBoard board;
  std::vector<SimBoardPose> poses;  ///< at least one; after the last one the first again
  /// The lens of the projector, as an inverse camera; its size is that of the projector's picture.
  CameraModel projector;
  double projector_blur_px = 0.4;        ///< of its lens, standard deviation in its pixels
  double reference_distance_mm = 350.0;  ///< at which its light has its peak irradiance
  double focus_mm = 350.0;               ///< distance from the camera at which a board is sharp
  double focus_px =
      1.0;  ///< blur far behind that: sigma = focus_px |1 - focus_mm / distance| besides the PSF
  double nudge_mm = 1.0;           ///< by how much a board moves that is knocked against
  std::optional<SeenFace> sample;  ///< the board is cut out where this is seen
};
Result<void> validate(const BoardSceneOptions& options);

/// Poses that a careful operator would choose: the board's middle at `distance_mm` in a grid over the camera's picture, tilted
/// by 15 to 40 degrees about axes that go round. Every pose wholly in the picture of the camera and in that of the projector, which
/// is what the distances and places are drawn anew for. The same seed gives the same poses.
std::vector<SimBoardPose> held_poses(const SimBoard& board,
                                     const CameraModel& camera,
                                     const CameraModel& projector,
                                     double distance_mm,
                                     int count,
                                     std::uint64_t seed);

/// The demo's lenses for boards: a camera of 40 degrees across `width` x `height` pixels, and a projector `baseline_mm` to its right
/// that looks at the same place, 350 mm away, with mild distortions.
CameraModel board_camera(int width, int height);
CameraModel board_projector(int width, int height, double baseline_mm = 120.0);

}  // namespace opaline::sim
