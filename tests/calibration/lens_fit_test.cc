// Boards as the simulator shows them, whose corners and lens are known.

#include "calibration/lens_fit.h"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "calibration/board_finder.h"
#include "tests/support/board_stage.h"

namespace opaline::calibration {
namespace {

using support::BoardStage;
using ::testing::HasSubstr;

/// Of all corners from where the scene puts them, px. A chessboard of which a half turn looks the same may be taken for that.
double rms_from_truth(const BoardStage& stage, const BoardView& view, std::size_t pose) {
  double best = 1e9;
  for (const bool turned : {false, true}) {
    double squares = 0.0;
    for (const BoardCorner& corner : view.corners) {
      const int id = turned ? stage.board.corner_count() - 1 - corner.id : corner.id;
      const auto p = stage.camera.model.project(
          stage.scene.poses[pose].sample_from_board.apply(stage.board.corner(id)));
      squares += std::pow(p.x - corner.pixel.x, 2) + std::pow(p.y - corner.pixel.y, 2);
    }
    best = std::min(best, std::sqrt(squares / static_cast<double>(view.corners.size())));
    if (stage.board.kind == Board::Kind::kCharuco) break;
  }
  return best;
}

std::vector<BoardView> all_views(BoardStage& stage) {
  std::vector<BoardView> views;
  for (std::size_t i = 0; i < stage.scene.poses.size(); ++i) views.push_back(stage.camera_view(i));
  return views;
}

Result<LensFit> fit(const BoardStage& stage, const std::vector<BoardView>& views) {
  return fit_lens(stage.camera.model.width, stage.camera.model.height, stage.board, views, {}, {});
}

std::array<double, 9> numbers_of(const CameraModel& m) {
  const auto& d = m.distortion;
  return {m.fx, m.fy, m.cx, m.cy, d[0], d[1], d[2], d[3], d[4]};
}

// 0.1 px is the goal for what is left after a fit.
/// Photographed once for all tests of fits.
struct Chessboard {
  BoardStage stage{Board::Kind::kChessboard, 15};
  std::vector<BoardView> views = all_views(stage);
};
Chessboard& chessboard() {
  static Chessboard all;
  return all;
}

TEST(FindBoard, CornersOfAChessboardAreWhereTheSceneHasThem) {
  const auto& [stage, views] = chessboard();
  for (std::size_t i = 0; i < views.size(); ++i) {
    EXPECT_EQ(views[i].fault, "");
    EXPECT_EQ(views[i].corners.size(), 54U);
    EXPECT_LT(rms_from_truth(stage, views[i], i), 0.1) << views[i].name;
  }
}

TEST(FindBoard, HalfACharucoBoardIsRecognisedByItsMarkers) {
  BoardStage stage(Board::Kind::kCharuco, 3);
  for (auto& pose : stage.scene.poses) pose.hidden = 0.4;
  for (std::size_t i = 0; i < 3; ++i) {
    const BoardView view = stage.camera_view(i);
    ASSERT_GE(view.corners.size(), 12U)
        << view.fault;  // of 24, three columns and part of the fourth
    EXPECT_LE(view.corners.size(), 16U);
    EXPECT_LT(rms_from_truth(stage, view, i), 0.1) << view.name;
  }
}

TEST(FindBoard, TheBlurOfEdgesIsTheLensAndThePixel) {
  BoardStage stage(Board::Kind::kChessboard, 1);
  const double sharp = stage.camera_view(0).blur_px;
  stage.scene.poses[0].defocus_px = 2.0;
  const double soft = stage.camera_view(0).blur_px;
  // Variances of what blurs add up; the profile ends at 0.45 squares, about 9 px, to either side.
  EXPECT_NEAR(std::sqrt(soft * soft - sharp * sharp), 2.0, 0.2);
}

TEST(FindBoard, APictureWithoutABoardSaysSo) {
  const auto view = find_board(Image<std::uint8_t>(64, 48, 1, 100), {}, "wall");
  ASSERT_TRUE(view);
  EXPECT_THAT(view->fault, HasSubstr("no board found"));
}

TEST(FindBoard, ABoardThatMakesNoSenseIsAnError) {
  const auto view = find_board(Image<std::uint8_t>(64, 48, 1), {.squares_x = 2}, "wall");
  ASSERT_FALSE(view);
  EXPECT_THAT(view.error().message, HasSubstr("squares_x = 2; expected 3 to 100"));
}

// How far off the truth: as far as the fit itself says that it may be. 4.5 deviations are exceeded by one normal number in 150 000.
TEST(LensFit, FindsTheLensWithinItsOwnUncertainty) {
  const auto& [stage, views] = chessboard();
  const auto found = fit(stage, views);
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_EQ(found->kept(), 15);
  EXPECT_LT(found->rms_px, 0.1);
  const auto is = numbers_of(found->lens);
  const auto should = numbers_of(stage.camera.model);
  for (std::size_t i = 0; i < 9; ++i)
    EXPECT_LT(std::abs(is[i] - should[i]), 4.5 * found->deviation[i]) << i;
  EXPECT_LT(found->deviation[0], 0.002 * found->lens.fx);  // and that is small
  EXPECT_GT(found->coverage, 0.6);
}

/// Corners of a small board in the middle of a long lens's picture, 0.01 px off at random.
std::vector<BoardView> small_board_views(const CameraModel& lens, const Board& board) {
  std::mt19937 random(5);
  std::normal_distribution<double> off(0.0, 0.01);
  std::vector<BoardView> views;
  for (int i = 0; i < 16; ++i) {
    const double around = 0.4 * i;
    const double a = std::cos(around);  // tilted by half a radian about (a, b, 0)
    const double b = std::sin(around);
    const double c = std::cos(0.5);
    const double d = std::sin(0.5);
    Pose tilt;
    tilt.rotation = {c + (1 - c) * a * a,
                     (1 - c) * a * b,
                     d * b,
                     (1 - c) * a * b,
                     c + (1 - c) * b * b,
                     -d * a,
                     -d * b,
                     d * a,
                     c};
    BoardView view;
    view.name = fmt::format("pose {}", i + 1);
    view.blur_px = 0.8;
    view.contrast = 150.0;
    for (int id = 0; id < board.corner_count(); ++id) {
      Vec3 p = tilt.apply(board.corner(id) - Vec3{13.5, 9.0, 0.0});
      p = p + Vec3{1.5 * std::cos(2.0 * i), 1.5 * std::sin(2.0 * i), 300.0};
      const auto pixel = lens.project(p);
      view.corners.push_back({id, {pixel.x + off(random), pixel.y + off(random)}});
    }
    views.push_back(std::move(view));
  }
  return views;
}

// With all terms free the corners of the picture, where no board was, are guessed several pixels off.
TEST(LensFit, HoldsTheRadialTermsThatASmallBoardDoesNotTell) {
  CameraModel lens;
  lens.width = lens.height = 400;
  lens.fx = lens.fy = 2500.0;
  lens.cx = lens.cy = 200.0;
  lens.distortion = {-0.08, 0.02, 1e-4, -1e-4, 0.0};
  const Board board{.squares_x = 10, .squares_y = 7, .square_mm = 3.0};
  const auto found = fit_lens(400, 400, board, small_board_views(lens, board), {}, {});
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_EQ(found->radial_terms, 1);
  EXPECT_EQ(found->lens.distortion[1], 0.0);
  EXPECT_EQ(found->lens.distortion[4], 0.0);
  EXPECT_GT(found->deviation[8], 1.0);          // of k3, while it was free
  const auto bend = [](const CameraModel& m) {  // of the ray to the picture's corner, px
    const Vec3 ray{0.08, 0.08, 1.0};
    CameraModel straight = m;
    straight.distortion = {};
    return m.project(ray).x - straight.project(ray).x;
  };
  EXPECT_NEAR(bend(found->lens), bend(lens), 0.5);
}

TEST(LensFit, AThirdOfTheViewsDefocusedOrHiddenAreNamedAndLeftOut) {
  BoardStage stage = BoardStage(Board::Kind::kChessboard, 15);
  std::vector<BoardView> views = chessboard().views;
  for (const std::size_t bad : {1, 7, 10}) stage.scene.poses[bad].defocus_px = 2.0;
  for (const std::size_t bad : {4, 13}) stage.scene.poses[bad].hidden = 0.3;
  for (const std::size_t bad : {1, 4, 7, 10, 13}) views[bad] = stage.camera_view(bad);
  const auto found = fit(stage, views);
  ASSERT_TRUE(found) << found.error().message;
  for (std::size_t i = 0; i < 15; ++i) {
    const std::string& reason = found->views[i].reason;
    if (i == 1 || i == 7 || i == 10) {
      EXPECT_THAT(reason, HasSubstr("out of focus")) << i;
    } else if (i == 4 || i == 13) {
      EXPECT_THAT(reason, HasSubstr("hidden")) << i;
    } else {
      EXPECT_EQ(reason, "") << i;
    }
  }
  EXPECT_NEAR(
      found->lens.fx / stage.camera.model.fx, 1.0, 4.5 * found->deviation[0] / found->lens.fx);
}

TEST(LensFit, AViewThatDoesNotFitTheOthersIsNamed) {
  const BoardStage& stage = chessboard().stage;
  auto views = chessboard().views;
  for (std::size_t c = 0; c < views[3].corners.size(); ++c)  // bent
    views[3].corners[c].pixel.x += 2.0 * std::sin(static_cast<double>(views[3].corners[c].id));
  views[6].corners[11].pixel.y += 5.0;  // a reflection
  const auto found = fit(stage, views);
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_THAT(found->views[3].reason, HasSubstr("does not fit"));
  EXPECT_EQ(found->kept(), 14);
  EXPECT_EQ(found->outliers, 1);
}

TEST(LensFit, TooFewViewsAreAnErrorThatNamesWhatWasWrongWithEach) {
  auto views = chessboard().views;
  views.resize(5);
  views[2].fault = "nobody held it";
  const auto found = fit(chessboard().stage, views);
  ASSERT_FALSE(found);
  EXPECT_THAT(found.error().message, HasSubstr("4 of 5 views can be used, 5 are needed"));
  EXPECT_THAT(found.error().message, HasSubstr("pose 3 (nobody held it)"));
}

TEST(LensFit, StopsWhenAsked) {
  const auto& [stage, views] = chessboard();
  std::stop_source stop;
  stop.request_stop();
  const auto found = fit_lens(stage.camera.model.width,
                              stage.camera.model.height,
                              stage.board,
                              views,
                              {},
                              stop.get_token());
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().code, ErrorCode::kCancelled);
}

}  // namespace
}  // namespace opaline::calibration
