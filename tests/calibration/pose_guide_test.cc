// Which poses lack, told from boards that are projected through a known lens.

#include "calibration/pose_guide.h"

#include <gmock/gmock.h>

#include <cmath>
#include <numbers>

namespace opaline::calibration {
namespace {

using ::testing::HasSubstr;

constexpr double kRadians = std::numbers::pi / 180.0;

class PoseGuideTest : public ::testing::Test {
 protected:
  PoseGuideTest() {
    lens_.width = 640;
    lens_.height = 480;
    lens_.fx = lens_.fy = 880.0;
    lens_.cx = 320.0;
    lens_.cy = 240.0;
    board_.square_mm = 13.0;
  }
  /// The board's middle at a place of the picture, its right edge `right` and its lower one `down` degrees nearer.
  BoardView view(double x, double y, double right, double down, double distance = 350.0) const {
    const double a = right * kRadians;
    const double b = down * kRadians;
    // About y first, then about x: the normal (0, 0, 1) becomes (sin a, sin b cos a, cos b cos a).
    Pose pose{{std::cos(a),
               0.0,
               std::sin(a),
               -std::sin(a) * std::sin(b),
               std::cos(b),
               std::sin(b) * std::cos(a),
               -std::sin(a) * std::cos(b),
               -std::sin(b),
               std::cos(a) * std::cos(b)},
              {}};
    const Vec3 middle{65.0, 45.5, 0.0};
    const Vec3 place{
        (x - lens_.cx) / lens_.fx * distance, (y - lens_.cy) / lens_.fy * distance, distance};
    pose.translation = place - pose.rotate(middle);
    BoardView seen{"pose", {}, 0.5, 200.0, ""};
    for (int id = 0; id < board_.corner_count(); ++id)
      seen.corners.push_back({id, lens_.project(pose.apply(board_.corner(id)))});
    return seen;
  }
  PoseGuide guide(const std::vector<BoardView>& views) const {
    return guide_poses(lens_.width, lens_.height, board_, views);
  }

  CameraModel lens_;
  Board board_;
};

// Four views without noise determine the lens, so its guess is exact to what the closed form rounds to.
TEST_F(PoseGuideTest, TellsHowTheBoardLies) {
  const auto found = guide({view(320, 240, 25, 0),
                            view(250, 240, -30, 0),
                            view(320, 300, 0, 20),
                            view(320, 200, 0, -35, 420)});
  ASSERT_EQ(found.lies.size(), 4U);
  EXPECT_NEAR(found.lies[0].right_deg, 25.0, 0.1);
  EXPECT_NEAR(found.lies[0].down_deg, 0.0, 0.1);
  EXPECT_NEAR(found.lies[1].tilt_deg(), 30.0, 0.1);
  EXPECT_NEAR(found.lies[3].down_deg, -35.0, 0.1);
  EXPECT_NEAR(found.farthest_mm / found.nearest_mm, 420.0 / 350.0, 0.05);
  EXPECT_EQ(found.right_nearer, 1);
  EXPECT_EQ(found.left_nearer, 1);
  EXPECT_EQ(found.bottom_nearer, 1);
  EXPECT_EQ(found.top_nearer, 1);
  EXPECT_EQ(found.flat, 0);
}

TEST_F(PoseGuideTest, WishesForThePartOfThePictureAndTheTiltThatLack) {
  std::vector<BoardView> views;
  for (const double x : {160.0, 320.0, 480.0}) {
    for (const double y : {120.0, 240.0, 360.0}) {
      if (x != 480.0 || y != 120.0) views.push_back(view(x, y, x < 300 ? 25 : -25, 0));
    }
  }
  views.push_back(view(320, 240, 0, 20));
  const auto found = guide(views);
  EXPECT_THAT(found.wish, HasSubstr("towards the upper right, its upper edge 15 to 40 degrees"));
  EXPECT_THAT(found.wish, HasSubstr("a third closer or farther"));
}

TEST_F(PoseGuideTest, CountsOnlyWhatWasSeen) {
  BoardView faulty = view(320, 240, 25, 0);
  faulty.fault = "no board found";
  const auto found = guide({faulty});
  EXPECT_EQ(found.poses, 0);
  EXPECT_EQ(found.coverage, 0.0);
  EXPECT_THAT(found.wish, HasSubstr("towards the upper left"));
  EXPECT_GT(guide({faulty, view(320, 240, 25, 0)}).coverage, 0.2);
}

}  // namespace
}  // namespace opaline::calibration
