#include "base/face_view.h"

#include <gtest/gtest.h>

namespace opaline {
namespace {

const Block kBlock{4, 3, 2, 0.5, 1.0, 2.0};

// Straight above the middle of cell (1, 2) of z_max, at (0.75, 2.5, 4): 3 away along x, 4 up.
TEST(FaceView, IsTheUnitVectorToTheCameraAlongTheFacesAxes) {
  const FaceView view = view_of_face(kBlock, Face::kZMax, {0.75 + 3.0, 2.5, 4.0 + 4.0});
  EXPECT_FLOAT_EQ(view.direction.at(1, 2, 0), 0.6F);
  EXPECT_FLOAT_EQ(view.direction.at(1, 2, 1), 0.0F);
  EXPECT_FLOAT_EQ(view.cosine.at(1, 2), 0.8F);
}

// Cell (2, 1) of x_min has its middle at (0, 2.5, 3); columns run along y, rows along z.
TEST(FaceView, KnowsTheAxesOfASide) {
  const FaceView view = view_of_face(kBlock, Face::kXMin, {-2.0, 2.5 + 1.0, 3.0 - 2.0});
  EXPECT_FLOAT_EQ(view.direction.at(2, 1, 0), 1.0F / 3.0F);
  EXPECT_FLOAT_EQ(view.direction.at(2, 1, 1), -2.0F / 3.0F);
  EXPECT_FLOAT_EQ(view.cosine.at(2, 1), 2.0F / 3.0F);
}

TEST(FaceView, HasACosineBelowZeroBehindTheFace) {
  EXPECT_LT(view_of_face(kBlock, Face::kYMax, {0.0, -5.0, 0.0}).cosine.at(0, 0), 0.0F);
}

}  // namespace
}  // namespace opaline
