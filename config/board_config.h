#pragma once

#include <array>
#include <cstdint>
#include <string_view>
#include <vector>

#include "calibration/geometry_options.h"
#include "calibration/placement.h"
#include "config/fields.h"
#include "sim/board_scene.h"
#include "sim/holder_optics.h"
#include "sim/rig_options.h"

namespace opaline::config {

inline constexpr std::array<std::string_view, 3> kBoardKindNames{"none", "chessboard", "charuco"};
inline constexpr std::array<std::string_view, 2> kProjectedNames{"sinusoids", "chessboards"};
enum class HolderKind : std::uint8_t { kNone, kCharuco };
inline constexpr std::array<std::string_view, 2> kHolderKindNames{"none", "charuco"};

/// A board that somebody holds before the simulated station in place of its sample.
struct SimBoardConfig {
  calibration::Board::Kind kind = calibration::Board::Kind::kNone;
  sim::SimBoard board;  ///< its kind is the one above
  int poses = 16;
  std::uint64_t seed = 7;               ///< of the poses
  double distance_mm = 350.0;           ///< from the camera, about
  std::vector<std::int64_t> defocused;  ///< poses, counted from 1, out of focus by 2.5 px
  std::vector<std::int64_t> hidden;     ///< poses in which a hand covers a third of it
  /// Of a projector whose kind is perpendicular; its size is that of the simulated one.
  CameraModel projector = sim::board_projector(640, 480);

  bool is_there() const { return kind != calibration::Board::Kind::kNone; }
};

/// What the simulated sample lies in.
struct SimHolderConfig {
  HolderKind kind = HolderKind::kNone;
  sim::HolderScene scene;
  bool is_there() const { return kind != HolderKind::kNone; }
};

void visit_board(Fields& fields, calibration::GeometryOptions& geometry);
void visit_sim_board(Fields& fields, SimBoardConfig& board);
void visit_holder(Fields& fields, calibration::HolderOptions& holder);
void visit_sim_holder(Fields& fields, SimHolderConfig& holder);
/// A simulated station knows its own.
calibration::HolderOptions holder_of(const SimHolderConfig& holder);

/// The scene that it describes; with fewer poses than asked for where not all find a place in both pictures.
sim::BoardSceneOptions board_scene(const SimBoardConfig& board, const sim::RigOptions& rig);

}  // namespace opaline::config
