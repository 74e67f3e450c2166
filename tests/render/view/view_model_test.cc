#include "render/view/view_model.h"

#include <gmock/gmock.h>

#include <chrono>
#include <cmath>
#include <optional>
#include <thread>

namespace opaline::render {
namespace {

constexpr int kWidth = 96;
constexpr int kHeight = 72;

Scene lit_ring() {
  Scene scene;
  scene.camera.position = {30.0, -36.0, 34.0};
  scene.camera.field_of_view_degrees = 26.0;
  scene.diffusion.tetrahedra = 4e3;
  scene.picture.refinement = 0;
  ObjectOptions ring;
  ring.name = "ring";
  ring.shape.name = "torus";
  ring.shape.size_mm = 20.0;
  ring.material.edit_cells = 40;
  ring.deform.kind = DeformOptions::Kind::kCage;
  ring.deform.amount = 0.0;
  ring.deform.handles = {{.point = {2, -1, -1}, .move = {0.0, 0.0, 8.0}}};
  scene.objects = {ring};
  scene.lights = {{.name = "sun", .direction = {-0.4, -0.8, -0.9}}};
  return scene;
}

class View : public ::testing::Test {
 protected:
  void SetUp() override {
    auto made = ViewModel::create(lit_ring(), {}, team_, [](std::string_view, double) {}, {});
    ASSERT_TRUE(made) << made.error().message;
    model_ = *std::move(made);
  }
  Image<std::uint8_t> picture(double stops = 0.0) {
    auto drawn = model_->picture(kWidth, kHeight, stops, {});
    EXPECT_TRUE(drawn) << drawn.error().message;
    return *std::move(drawn);
  }
  static int largest_difference(const Image<std::uint8_t>& a, const Image<std::uint8_t>& b) {
    int most = 0;
    for (std::size_t i = 0; i < a.samples().size(); ++i) {
      most = std::max(most, std::abs(a.samples()[i] - b.samples()[i]));
    }
    return most;
  }
  /// A pixel on the ring's near side.
  static constexpr double kX = 0.5 * kWidth;
  static constexpr double kY = 0.72 * kHeight;

  ThreadTeam team_{2};
  std::unique_ptr<ViewModel> model_;
};

TEST_F(View, AWholeTurnOfTheCameraEndsWhereItBegan) {
  const auto before = picture();
  for (int k = 0; k < 4; ++k) model_->orbit(45.0, 0.0);
  EXPECT_GT(largest_difference(picture(), before), 20);
  for (int k = 0; k < 4; ++k) model_->orbit(45.0, 0.0);
  model_->zoom(2.0);
  model_->zoom(0.5);
  model_->pan(0.1, 0.2);
  model_->pan(-0.1, -0.2);
  EXPECT_LE(largest_difference(picture(), before), 2);
}

TEST_F(View, AStrokeIsLitAtOnceAndItsEnvironmentIsFollowedWhenNothingMoves) {
  Scene scene = lit_ring();
  scene.environment.radiance = {0.5, 0.5, 0.5};
  auto made = ViewModel::create(scene, {}, team_, [](std::string_view, double) {}, {});
  ASSERT_TRUE(made) << made.error().message;
  model_ = *std::move(made);
  picture();
  EditOptions brush;
  brush.operation = EditOptions::Operation::kScale;
  brush.value = {3.0, 3.0, 3.0};
  ASSERT_TRUE(model_->paint_all(0, brush));
  std::vector<DiffuseEntry> seen;
  std::uint64_t version = 0;
  std::optional<Image<std::uint8_t>> last;
  for (bool goes_on = true; goes_on;) {
    auto drawn = model_->picture_now(kWidth, kHeight, 0.0, {});
    ASSERT_TRUE(drawn) << drawn.error().message;
    last = *std::move(drawn);
    const DiffuseEntry entry = model_->statistics().objects[0].environment;
    if (version != model_->version()) seen.push_back(entry);
    version = model_->version();
    goes_on = model_->is_lighting();
    if (goes_on) std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  EXPECT_EQ(seen.back(), DiffuseEntry::kFollowed);
  EXPECT_THAT(seen, ::testing::Contains(DiffuseEntry::kFollowedBefore));
  model_->orbit(0.0, 0.0);
  EXPECT_LE(largest_difference(picture(), *last), 2);
}

TEST_F(View, TheCameraStopsBeforeThePole) {
  model_->orbit(0.0, 500.0);
  const CameraOptions& c = model_->scene().camera;
  const double cosine = dot(normalized(c.position - c.target), c.up);
  EXPECT_NEAR(cosine, std::cos(2.0 * 3.14159265 / 180.0), 1e-6);
}

TEST_F(View, AStrokeIsSeenTakenBackAndDoneAgain) {
  const auto before = picture();
  EditOptions brush;
  brush.value = {0.5, 0.5, 0.01};
  const auto cells = model_->paint(kX, kY, kWidth, kHeight, brush);
  ASSERT_TRUE(cells) << cells.error().message;
  ASSERT_GT(*cells, 0U);
  const auto painted = picture();
  EXPECT_GT(largest_difference(painted, before), 10);
  ASSERT_TRUE(*model_->undo());
  EXPECT_LE(largest_difference(picture(), before), 2);
  EXPECT_FALSE(*model_->undo());
  ASSERT_TRUE(*model_->redo());
  EXPECT_LE(largest_difference(picture(), painted), 2);
}

TEST_F(View, TheDabsOfAStrokeAreTakenBackTogetherAndTheStrokeBeforeStays) {
  EditOptions brush;
  brush.value = {0.5, 0.5, 0.01};
  brush.radius_mm = 2.0;
  ASSERT_GT(*model_->paint(kX, kY, kWidth, kHeight, brush), 0U);
  const auto first = picture();
  ASSERT_TRUE(
      model_->paint(1.0, 1.0, kWidth, kHeight, brush));  // a stroke that begins beside the ring
  ASSERT_GT(*model_->paint(kX + 12.0, kY, kWidth, kHeight, brush, true), 0U);
  ASSERT_GT(*model_->paint(kX + 18.0, kY - 3.0, kWidth, kHeight, brush, true), 0U);
  const auto both = picture();
  EXPECT_GT(largest_difference(both, first), 10);

  ASSERT_TRUE(*model_->undo());
  EXPECT_LE(largest_difference(picture(), first), 2);
  ASSERT_TRUE(*model_->redo());
  EXPECT_LE(largest_difference(picture(), both), 2);
  EXPECT_FALSE(*model_->redo());
  ASSERT_TRUE(*model_->undo());
  ASSERT_TRUE(*model_->undo());
  EXPECT_FALSE(*model_->undo());
}

TEST_F(View, PaintingBesideTheObjectsDoesNothing) {
  const auto cells = model_->paint(1.0, 1.0, kWidth, kHeight, {});
  ASSERT_TRUE(cells);
  EXPECT_EQ(*cells, 0U);
  EXPECT_FALSE(model_->can_undo());
}

TEST_F(View, AWholeObjectIsScaled) {
  const auto before = picture();
  EditOptions brush;
  brush.operation = EditOptions::Operation::kScale;
  brush.value = {1.0, 30.0, 1.0};
  ASSERT_GT(*model_->paint_all(0, brush), 10'000U);
  EXPECT_GT(largest_difference(picture(), before), 20);
}

TEST_F(View, LightsTurnAndDim) {
  const auto before = picture();
  model_->turn_light(0, 90.0, 0.0);
  EXPECT_GT(largest_difference(picture(), before), 20);
  model_->turn_light(0, -90.0, 0.0);
  EXPECT_LE(largest_difference(picture(), before), 2);
  model_->scale_light(0, 0.5);
  model_->scale_light(0, 2.0);
  EXPECT_LE(largest_difference(picture(), before), 2);
  EXPECT_LE(largest_difference(picture(1.0), before), 255);
}

TEST_F(View, ABendGoesAndComes) {
  const auto before = picture();
  const auto inverted = model_->bend(0, 1.0);
  ASSERT_TRUE(inverted) << inverted.error().message;
  EXPECT_EQ(*inverted, 0U);
  EXPECT_GT(largest_difference(picture(), before), 20);
  ASSERT_TRUE(model_->bend(0, 0.0));
  EXPECT_LE(largest_difference(picture(), before), 2);
}

TEST_F(View, ALostDeviceIsReplaced) {
  const auto before = picture();
  model_->lose_device();
  EXPECT_EQ(largest_difference(picture(), before), 0);
  EXPECT_EQ(model_->device_losses(), 1);
  EXPECT_EQ(largest_difference(picture(), before), 0);
  EXPECT_EQ(model_->device_losses(), 1);
}

// A tolerance that takes the solver tens of iterations: the first pictures come before the light does.
TEST_F(View, ShowsTheLightThereWasWhileItFindsTheNext) {
  const auto before = picture();
  const std::uint64_t old = model_->version();
  model_->turn_light(0, 120.0, 0.0);
  const auto at_once = model_->picture_now(kWidth, kHeight, 0.0, {});
  ASSERT_TRUE(at_once) << at_once.error().message;
  EXPECT_EQ(largest_difference(*at_once, before), 0);
  EXPECT_TRUE(model_->is_lighting());
  while (model_->is_lighting()) ASSERT_TRUE(model_->catch_up());
  EXPECT_GT(model_->version(), old + 1);
  const auto later = model_->picture_now(kWidth, kHeight, 0.0, {});
  ASSERT_TRUE(later) << later.error().message;
  EXPECT_GT(largest_difference(*later, before), 20);
  EXPECT_LE(largest_difference(picture(), *later), 1);
}

TEST_F(View, AStrokeWhileLightIsFoundIsLitToo) {
  const auto before = picture();
  model_->turn_light(0, 10.0, 0.0);
  ASSERT_TRUE(model_->picture_now(kWidth, kHeight, 0.0, {}));
  EditOptions brush;
  brush.operation = EditOptions::Operation::kPaint;
  brush.value = {0.9, 0.01, 0.01};
  ASSERT_TRUE(model_->paint(kX, kY, kWidth, kHeight, brush));
  EXPECT_FALSE(model_->is_lighting());
  ASSERT_TRUE(model_->picture_now(kWidth, kHeight, 0.0, {}));
  EXPECT_TRUE(model_->is_lighting());
  while (model_->is_lighting()) ASSERT_TRUE(model_->catch_up());
  const auto painted = model_->picture_now(kWidth, kHeight, 0.0, {});
  ASSERT_TRUE(painted);
  EXPECT_GT(largest_difference(*painted, before), 20);
  EXPECT_LE(largest_difference(picture(), *painted), 1);
}

}  // namespace
}  // namespace opaline::render
