#include "config/board_config.h"

#include <algorithm>

#include "config/pose_fields.h"

namespace opaline::config {
namespace {

constexpr Range kSquares{.min = 3, .max = 100};
constexpr Range kMostPoses{.min = 6, .max = 100};
constexpr double kDefocus = 2.5;  // px
constexpr double kHidden = 1.0 / 3.0;

template <class AnyBoard>
void visit_squares(Fields& fields, AnyBoard& board, bool is_charuco) {
  std::array<int, 2> squares{board.squares_x, board.squares_y};
  fields.wholes({"squares", "columns and rows of them"}, squares, kSquares);
  board.squares_x = squares[0];
  board.squares_y = squares[1];
  fields.length_mm({"square", "side of one"}, board.square_mm);
  fields.length_mm({"marker", "side of a marker, when kind = \"charuco\""}, board.marker_mm);
  fields.check(
      !is_charuco || board.marker_mm < board.square_mm, "marker", "expected less than the square");
  fields.check(!is_charuco || board.squares_x * board.squares_y / 2 <= 50,
               "squares",
               "expected at most 101 in all: the dictionary has 50 markers");
}

}  // namespace

void visit_board(Fields& fields, calibration::GeometryOptions& geometry) {
  calibration::Board& board = geometry.board;
  fields.one_of({"kind", "none: lenses stay as given"}, board.kind, kBoardKindNames);
  visit_squares(fields, board, board.kind == calibration::Board::Kind::kCharuco);
  fields.length_mm({"known_length", "first to last inner corner of a row, by calliper"},
                   board.known_length_mm,
                   Range::at_least(0.0));
  fields.check(!geometry.has_board() || board.known_length_mm > 0.0,
               "known_length",
               "measure with a calliper from the first to the last inner corner of a row");
  fields.one_of({"projector", "what it shows on the board; the latter on a chessboard"},
                geometry.projected,
                kProjectedNames);
  fields.check(geometry.projected == calibration::GeometryOptions::Projected::kSinusoids ||
                   board.kind != calibration::Board::Kind::kCharuco,
               "projector",
               "expected \"sinusoids\" with a ChArUco board: markers leave no white paper");
  fields.whole({"poses", "to show it in"}, geometry.poses, kMostPoses);
  fields.duration({"time_to_move", "lamp off before each pose"}, geometry.time_to_move);
}

void visit_sim_board(Fields& fields, SimBoardConfig& board) {
  fields.one_of({"kind", "none: the sample is there"}, board.kind, kBoardKindNames);
  const bool is_charuco = board.kind == calibration::Board::Kind::kCharuco;
  board.board.kind = is_charuco ? sim::SimBoardKind::kCharuco : sim::SimBoardKind::kChessboard;
  visit_squares(fields, board.board, is_charuco);
  fields.length_mm({"margin", "white paper around the squares"}, board.board.margin_mm);
  fields.whole({"poses", "that it is held in, one after the other, whenever the lamp goes dark"},
               board.poses,
               kMostPoses);
  fields.whole({"seed", "of the poses"}, board.seed, Range::at_least(0));
  fields.length_mm({"distance", "from the camera, about"}, board.distance_mm);
  fields.integers({"defocused", "poses, from 1, that are out of focus"},
                  board.defocused,
                  0,
                  Range::between(1, kMostPoses.max));
  fields.integers({"hidden", "poses, from 1, in which a hand covers a third of the board"},
                  board.hidden,
                  0,
                  Range::between(1, kMostPoses.max));
  fields.table({"projector_lens", "The lens of a projector that is not in perspective otherwise."},
               [&](Fields& f) { visit_projector_lens(f, board.projector); });
}

void visit_holder(Fields& fields, calibration::HolderOptions& holder) {
  HolderKind kind = holder.is_there() ? HolderKind::kCharuco : HolderKind::kNone;
  fields.one_of(
      {"kind", "none: the camera stands where the rig file has it"}, kind, kHolderKindNames);
  visit_squares(fields, holder.board, kind == HolderKind::kCharuco);
  visit_pose(fields, holder.sample_from_board, "board", "sample");
  holder.board.kind = kind == HolderKind::kCharuco ? calibration::Board::Kind::kCharuco
                                                   : calibration::Board::Kind::kNone;
}

void visit_sim_holder(Fields& fields, SimHolderConfig& holder) {
  sim::HolderScene& scene = holder.scene;
  fields.one_of({"kind", "none: the sample floats"}, holder.kind, kHolderKindNames);
  visit_squares(fields, scene.board, holder.is_there());
  fields.length_mm({"margin", "white around the squares"}, scene.board.margin_mm);
  fields.number({"glow", "exitance of its front over the irradiance beside the sample"},
                scene.glow,
                Range::between(0.0, 1.0));
  visit_pose(fields, scene.sample_from_board, "board", "sample");
}

calibration::HolderOptions holder_of(const SimHolderConfig& holder) {
  calibration::HolderOptions options;
  if (!holder.is_there()) return options;
  options.board.kind = calibration::Board::Kind::kCharuco;
  options.board.squares_x = holder.scene.board.squares_x;
  options.board.squares_y = holder.scene.board.squares_y;
  options.board.square_mm = holder.scene.board.square_mm;
  options.board.marker_mm = holder.scene.board.marker_mm;
  options.sample_from_board = holder.scene.sample_from_board;
  return options;
}

sim::BoardSceneOptions board_scene(const SimBoardConfig& board, const sim::RigOptions& rig) {
  sim::BoardSceneOptions scene;
  scene.board = board.board;
  const bool has_lens = rig.projector.kind == sim::ProjectorKind::kPerspective;
  scene.projector = has_lens ? rig.projector.lens : board.projector;
  scene.projector.width = rig.projector.width;
  scene.projector.height = rig.projector.height;
  scene.focus_mm = board.distance_mm;
  scene.reference_distance_mm = has_lens ? rig.projector.reference_distance_mm : board.distance_mm;
  scene.poses = sim::held_poses(
      scene.board, rig.camera.model, scene.projector, board.distance_mm, board.poses, board.seed);
  const auto last = static_cast<std::int64_t>(scene.poses.size());
  for (const std::int64_t pose : board.defocused) {
    if (pose <= last) scene.poses[static_cast<std::size_t>(pose - 1)].defocus_px = kDefocus;
  }
  for (const std::int64_t pose : board.hidden) {
    if (pose <= last) scene.poses[static_cast<std::size_t>(pose - 1)].hidden = kHidden;
  }
  return scene;
}

}  // namespace opaline::config
