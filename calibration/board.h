#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/camera_model.h"
#include "base/pose.h"

namespace opaline::calibration {

/// A flat calibration board. Its frame has the origin in the board's upper left corner, x along its rows, y down, z away
/// from whoever looks at it; inner corner `id` of row j, column i lies at ((i + 1) square, (j + 1) square, 0), and
/// id = j (squares_x - 1) + i.
///
/// A ChArUco board has an ArUco marker of the dictionary DICT_4X4_50 in each white square (Garrido-Jurado et al. 2014), in
/// order from the upper left, so that it may be partly hidden. The square in the upper left corner is black.
struct Board {
  enum class Kind : std::uint8_t { kNone, kChessboard, kCharuco };
  Kind kind = Kind::kChessboard;
  int squares_x = 10;
  int squares_y = 7;
  double square_mm = 20.0;
  double marker_mm = 15.0;  ///< of kCharuco
  /// From the first to the last inner corner of a row as measured with a calliper and not computed from the squares, mm; 0:
  /// not measured.
  double known_length_mm = 0.0;

  int columns() const { return squares_x - 1; }  ///< of inner corners
  int rows() const { return squares_y - 1; }
  int corner_count() const { return columns() * rows(); }
  Vec3 corner(int id) const {
    const int row = id / columns();
    return {(id % columns() + 1) * square_mm, (row + 1) * square_mm, 0.0};
  }
};

/// A corner of the board where it was seen.
struct BoardCorner {
  int id = 0;
  CameraModel::Pixel pixel;
};

/// One pose of the board as one lens saw it.
struct BoardView {
  std::string name;  ///< "pose 3", "left03.jpg"
  std::vector<BoardCorner> corners;
  double blur_px = 0.0;   ///< standard deviation of a Gaussian that blurs the edges as much
  double contrast = 0.0;  ///< of white against black squares, in codes of 255
  std::string fault;      ///< why it cannot be used: "no corners found"; empty: nothing
};

}  // namespace opaline::calibration
