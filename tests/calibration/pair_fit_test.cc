// A projector as an inverse camera, against the simulator's lenses and poses.

#include "calibration/pair_fit.h"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <array>
#include <cmath>
#include <numeric>
#include <vector>

#include "calibration/board_finder.h"
#include "tests/support/board_stage.h"

namespace opaline::calibration {
namespace {

using support::BoardStage;
using ::testing::HasSubstr;

constexpr std::size_t kPoses = 8;
constexpr std::size_t kMoved = 4;

struct Views {
  std::vector<BoardView> camera;
  std::vector<BoardView> projector;
};

/// Photographed once for all tests; pose kMoved was knocked against before the patterns.
struct Photographed {
  BoardStage stage{Board::Kind::kChessboard, kPoses};
  Views still;
  BoardView moved;

  Photographed() {
    for (std::size_t i = 0; i < kPoses; ++i) {
      const ProjectorMap map = stage.projector_map(i);
      still.camera.push_back(
          *find_board(grey_of(map.mean), stage.board, fmt::format("pose {}", i + 1)));
      still.projector.push_back(projector_view(map, still.camera.back(), stage.board));
    }
    stage.scene.poses[kMoved].sample_from_board.translation.z += 1.0;
    moved = projector_view(stage.projector_map(kMoved), still.camera[kMoved], stage.board);
    stage.scene.poses[kMoved].sample_from_board.translation.z -= 1.0;
  }
};

const Photographed& photographed() {
  static const Photographed all;
  return all;
}

Result<PairFit> fit(const Views& views) {
  const BoardStage& stage = photographed().stage;
  const CameraModel& camera = stage.camera.model;
  return fit_pair({camera.width, camera.height},
                  {stage.projector.width, stage.projector.height},
                  stage.board,
                  views.camera,
                  views.projector,
                  {},
                  {});
}

std::array<double, 9> numbers_of(const CameraModel& m) {
  const auto& d = m.distortion;
  return {m.fx, m.fy, m.cx, m.cy, d[0], d[1], d[2], d[3], d[4]};
}

double length_error(const PairFit& fit, const Views& views, double true_length) {
  const auto lengths = row_lengths(fit, photographed().stage.board, views.camera, views.projector);
  const double sum = std::accumulate(lengths.begin(), lengths.end(), 0.0);
  return sum / static_cast<double>(lengths.size()) / true_length - 1.0;
}

// The limits on what is left and on lengths are the issue's.
TEST(PairFit, FindsBothLensesAndTheProjectorsPlace) {
  const BoardStage& stage = photographed().stage;
  const Views& views = photographed().still;
  const auto found = fit(views);
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_EQ(found->kept(), static_cast<int>(kPoses));
  EXPECT_LT(found->camera.rms_px, 0.10);
  EXPECT_LT(found->projector.rms_px, 0.05);
  EXPECT_LT(found->stereo_rms_px, 0.15);
  EXPECT_LT(std::abs(length_error(*found, views, 8 * stage.scene.board.square_mm)), 0.0005);
  const Vec3 off = found->joint_projector.centre() - stage.scene.projector.centre();
  EXPECT_LT(length(off), 0.005 * length(stage.scene.projector.centre()));
}

// 6 deviations: the corners' errors are not all independent, for a corner that the camera sees wrongly is carried to the projector.
TEST(PairFit, IsOffByWhatItSaysItMayBe) {
  const BoardStage& stage = photographed().stage;
  const auto found = fit(photographed().still);
  ASSERT_TRUE(found) << found.error().message;
  const std::array<std::array<double, 9>, 2> is{numbers_of(found->joint_camera),
                                                numbers_of(found->joint_projector)};
  const std::array<std::array<double, 9>, 2> should{numbers_of(stage.camera.model),
                                                    numbers_of(stage.scene.projector)};
  for (std::size_t lens = 0; lens < 2; ++lens) {
    for (std::size_t i = 0; i < 9; ++i)
      EXPECT_LT(std::abs(is[lens][i] - should[lens][i]), 6.0 * found->deviation[lens][i])
          << lens << " " << i;
  }
}

TEST(PairFit, ABoardThatMovedBeforeThePatternsIsNamedAndLeftOut) {
  Views views = photographed().still;
  views.projector[kMoved] = photographed().moved;
  const auto found = fit(views);
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_EQ(found->kept(), static_cast<int>(kPoses) - 1);
  EXPECT_THAT(found->views[kMoved].reason, HasSubstr("it moved before the patterns"));
}

TEST(PairFit, ABoardOfAnotherSizeFitsAsWellButItsLengthDoesNot) {
  const Photographed& all = photographed();
  Views views = all.still;
  Board believed = all.stage.board;
  believed.square_mm *= 1.02;
  const auto found = fit_pair({all.stage.camera.model.width, all.stage.camera.model.height},
                              {all.stage.projector.width, all.stage.projector.height},
                              believed,
                              views.camera,
                              views.projector,
                              {},
                              {});
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_LT(found->stereo_rms_px, 0.15);  // which is why a length is asked for
  EXPECT_NEAR(length_error(*found, views, 8 * all.stage.scene.board.square_mm), 0.02, 0.0005);
}

TEST(DecodePhases, ACountOfPicturesThatIsNotThatOfThePatternsIsAnError) {
  const std::vector<Image<float>> two(2, Image<float>(4, 4, 1));
  const auto map = decode_phases({}, two, 1.0);
  ASSERT_FALSE(map);
  EXPECT_EQ(map.error().message, "2 pictures of 24 patterns");
}

TEST(DecodePhases, TooLittleLightTellsNothing) {
  const std::vector<Image<float>> dark(24, Image<float>(4, 4, 1, 7.0f));
  const auto map = decode_phases({}, dark, 1.0);
  ASSERT_TRUE(map);
  EXPECT_TRUE(std::isnan(map->x.at(1, 2)));
}

}  // namespace
}  // namespace opaline::calibration
