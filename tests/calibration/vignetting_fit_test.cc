// Vignetting of a simulated camera and projector, from white squares in poses that are known.

#include "calibration/vignetting_fit.h"

#include <gmock/gmock.h>

#include <array>
#include <cmath>
#include <vector>

#include "tests/support/board_stage.h"

namespace opaline::calibration {
namespace {

using support::BoardStage;

constexpr std::size_t kPoses = 12;

Image<float> even_light(BoardStage& stage, std::size_t pose) {
  const auto seen = stage.photograph(
      pose, Image<std::uint8_t>(stage.projector.width, stage.projector.height, 1, 255));
  Image<float> even(seen.width(), seen.height(), 1);
  for (std::size_t s = 0; s < seen.samples().size(); ++s)
    even.samples()[s / 3] +=
        static_cast<float>((seen.samples()[s] - stage.camera.black_level) / 3.0);
  return even;
}

/// The white squares of a stage, and its true lenses and poses.
struct Seen {
  BoardStage stage{Board::Kind::kChessboard, kPoses};
  PairFit fit;
  std::vector<std::vector<PaperLight>> papers;

  Seen(std::array<double, 3> camera, std::array<double, 3> projector) {
    stage.camera.vignetting = camera;
    stage.projector.vignetting = projector;
    fit.joint_camera = stage.camera.model;
    fit.joint_projector = stage.scene.projector;
    for (std::size_t i = 0; i < kPoses; ++i) {
      fit.views.emplace_back().camera_from_board = stage.scene.poses[i].sample_from_board;
      BoardView view;  // corners as the scene has them
      for (int id = 0; id < stage.board.corner_count(); ++id)
        view.corners.push_back(
            {id,
             stage.camera.model.project(
                 stage.scene.poses[i].sample_from_board.apply(stage.board.corner(id)))});
      papers.push_back(paper_light(even_light(stage, i), view, stage.board));
    }
  }
  /// RMS of it from the truth over a lens's picture.
  static double off(const VignettingFit& found,
                    std::size_t lens,
                    const std::array<double, 3>& truth) {
    double squares = 0.0;
    for (int y = -9; y <= 9; ++y) {
      for (int x = -12; x <= 12; ++x) {
        const double r2 = (x * x + y * y) / 225.0;
        const double should = 1.0 + r2 * (truth[0] + r2 * (truth[1] + r2 * truth[2]));
        squares += std::pow(found.at(lens, r2) - should, 2) / (19.0 * 25.0);
      }
    }
    return std::sqrt(squares);
  }
};

// 0.5 % is what a session takes over at most; four of the deviations that it says itself.
TEST(VignettingFit, TellsTheCamerasFromTheProjectors) {
  constexpr std::array<double, 3> kCamera{-0.15, 0.02, 0.0};
  constexpr std::array<double, 3> kProjector{-0.08, 0.0, 0.0};
  const Seen seen(kCamera, kProjector);
  const auto found = fit_vignetting(seen.fit, seen.papers);
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_GT(found->squares, 200);
  EXPECT_LT(found->residual, 0.005);
  for (std::size_t lens = 0; lens < 2; ++lens) {
    EXPECT_LT(found->deviation[lens], 0.005);
    EXPECT_LT(Seen::off(*found, lens, lens == 0 ? kCamera : kProjector),
              4.0 * found->deviation[lens])
        << lens;
  }
}

TEST(VignettingFit, OfLensesWithoutAnyIsNone) {
  const Seen seen({0.0, 0.0, 0.0}, {0.0, 0.0, 0.0});
  const auto found = fit_vignetting(seen.fit, seen.papers);
  ASSERT_TRUE(found) << found.error().message;
  for (std::size_t lens = 0; lens < 2; ++lens)
    EXPECT_LT(Seen::off(*found, lens, {}), 4.0 * found->deviation[lens]);
}

TEST(VignettingFit, WantsEnoughSquares) {
  const PairFit fit;
  const auto found = fit_vignetting(fit, {});
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().message, "0 white squares; vignetting wants 100");
}

TEST(PaperLight, IsOfWhiteSquaresAlsoWhereTheBoardIsTakenForItsHalfTurn) {
  Board board{.squares_x = 6, .squares_y = 5, .square_mm = 1.0};
  Image<float> even(120, 100, 1);
  for (int y = 0; y < 100; ++y) {
    for (int x = 0; x < 120; ++x) even.at(x, y) = (x / 20 + y / 20) % 2 == 1 ? 5.0f : 1.0f;
  }
  BoardView straight;
  BoardView turned;
  for (int id = 0; id < board.corner_count(); ++id) {
    const Vec3 p = board.corner(id);
    straight.corners.push_back({id, {20.0 * p.x, 20.0 * p.y}});
    turned.corners.push_back({board.corner_count() - 1 - id, {20.0 * p.x, 20.0 * p.y}});
  }
  for (const BoardView& view : {straight, turned}) {
    const auto papers = paper_light(even, view, board);
    EXPECT_EQ(papers.size(), 6u);
    for (const PaperLight& paper : papers) EXPECT_EQ(paper.light, 5.0);
  }
  board.kind = Board::Kind::kCharuco;
  EXPECT_TRUE(paper_light(even, straight, board).empty());
}

}  // namespace
}  // namespace opaline::calibration
