#include "render/edit/material_editor.h"

#include <gmock/gmock.h>

#include <cmath>

#include "base/io/image_io.h"
#include "base/io/volume_io.h"
#include "tests/support/temporary_directory.h"

namespace opaline::render {
namespace {

using ::testing::HasSubstr;
using Operation = EditOptions::Operation;
using Quantity = EditOptions::Quantity;
using Reach = EditOptions::Reach;

/// 20 x 20 x 20 cells of 1 mm, corner at (-10, -10, -10).
std::shared_ptr<Material> plain_block() {
  Material material;
  material.block = {20, 20, 20, 1.0, 1.0, 1.0};
  for (auto& channel : material.channels) {
    channel.absorption.assign(material.block.cell_count(), 0.01);
    channel.reduced_scattering.assign(material.block.cell_count(), 2.0);
  }
  return std::make_shared<Material>(material);
}

class Painting : public ::testing::Test {
 protected:
  double absorption(int i, int j, int k, int channel = 0) const {
    return block_->channels[channel].absorption[block_->block.index(i, j, k)];
  }
  double scattering(int i, int j, int k) const {
    return block_->channels[0].reduced_scattering[block_->block.index(i, j, k)];
  }
  std::size_t apply(const EditOptions& edit) {
    const auto cells = editor_.apply(edit);
    EXPECT_TRUE(cells) << cells.error().message;
    return cells ? *cells : 0;
  }
  /// All of a ball around the middle of cell (10, 10, 10), which is at (0.5, 0.5, 0.5).
  EditOptions hard(Operation operation, double value) const {
    EditOptions edit;
    edit.operation = operation;
    edit.value = {value, 2.0 * value, 3.0 * value};
    edit.centre = {0.5, 0.5, 0.5};
    edit.radius_mm = 2.5;
    edit.softness = 0.0;
    return edit;
  }

  std::shared_ptr<Material> block_ = plain_block();
  MaterialEditor editor_{
      block_, {-10.0, -10.0, -10.0}, 1.0, [](Vec3 p) { return length(p) - 8.0; }};
  testing::TemporaryDirectory directory_;
};

TEST_F(Painting, ABallOfCellsIsCountedAsOneCountsByHand) {
  EXPECT_EQ(apply(hard(Operation::kSet, 0.5)),
            81U);  // integer places within 2.5 of one: 1+6+12+8+6+24+24
  EXPECT_EQ(absorption(10, 10, 10), 0.5);
  EXPECT_EQ(absorption(12, 10, 10), 0.5);
  EXPECT_EQ(absorption(13, 10, 10), 0.01);
  EXPECT_EQ(absorption(10, 10, 10, 2), 1.5);
  EXPECT_EQ(scattering(10, 10, 10), 2.0);
}

TEST_F(Painting, EachOperationDoesItsArithmetic) {
  EditOptions half = hard(Operation::kPaint, 0.5);
  half.strength = 0.5;
  apply(half);
  EXPECT_NEAR(absorption(10, 10, 10), 0.255, 1e-12);
  EditOptions scaled = hard(Operation::kScale, 4.0);
  scaled.strength = 0.5;
  apply(scaled);
  EXPECT_NEAR(absorption(10, 10, 10), 0.51, 1e-12);
  apply(hard(Operation::kAdd, 0.1));
  EXPECT_NEAR(absorption(10, 10, 10), 0.61, 1e-12);
  apply(hard(Operation::kAdd, -7.0));
  EXPECT_EQ(absorption(10, 10, 10), 0.0);
  EditOptions scatter = hard(Operation::kAdd, -7.0);
  scatter.quantity = Quantity::kReducedScattering;
  apply(scatter);
  EXPECT_EQ(scattering(10, 10, 10), 1e-6);
}

TEST_F(Painting, SoftBrushesFallOffTowardsTheirRim) {
  EditOptions soft = hard(Operation::kPaint, 1.01);
  soft.radius_mm = 4.0;
  soft.softness = 1.0;
  apply(soft);
  EXPECT_NEAR(absorption(10, 10, 10), 1.01, 1e-12);
  EXPECT_NEAR(absorption(12, 10, 10), 0.51, 1e-12);  // a smoothstep is 1/2 half way
  EXPECT_EQ(absorption(14, 10, 10), 0.01);
}

TEST_F(Painting, ABrushAtADepthLeavesWhatIsAboveAndBelow) {
  EditOptions deep = hard(Operation::kSet, 0.5);
  deep.reach = Reach::kDepth;
  deep.depth_mm = 3.0;
  deep.thickness_mm = 2.0;
  deep.radius_mm = 1.0;
  apply(deep);  // along z through (0.5, 0.5): the sphere of 8 mm is 3 mm deep where r = 5
  for (int k = 0; k < 20; ++k) {
    const double r = std::sqrt(0.5 + std::pow(k - 9.5, 2));
    EXPECT_EQ(absorption(10, 10, k), std::abs(r - 5.0) < 1.0 ? 0.5 : 0.01) << k;
  }
  EXPECT_EQ(absorption(11, 10, 15), 0.01);
}

TEST_F(Painting, ABrushThroughTheVolumeTakesAllAlongItsAxis) {
  EditOptions through = hard(Operation::kSet, 0.5);
  through.reach = Reach::kThrough;
  through.direction = {2.0, 0.0, 0.0};
  through.radius_mm = 0.9;
  EXPECT_EQ(apply(through), 20U);
  EXPECT_EQ(absorption(0, 10, 10), 0.5);
  EXPECT_EQ(absorption(19, 10, 10), 0.5);
  EXPECT_EQ(absorption(10, 11, 10), 0.01);
}

TEST_F(Painting, AMaskIsProjectedAlongTheDirection) {
  Image<std::uint8_t> picture(2, 2, 1);
  picture.at(1, 0, 0) = 255;  // the right half of the top row
  const auto bytes = encode_image({picture, {}, {}}, ImageFormat::kPng);
  ASSERT_TRUE(bytes);
  ASSERT_TRUE(write_whole(system_files(), directory_.path() / "mask.png", *bytes));
  EditOptions masked = hard(Operation::kSet, 0.5);
  masked.reach = Reach::kThrough;
  masked.direction = {0.0, 1.0, 0.0};  // right is z x y = -x, up is z
  masked.radius_mm = 4.0;
  masked.mask = directory_.path() / "mask.png";
  apply(masked);
  EXPECT_EQ(absorption(8, 10, 12), 0.5);
  EXPECT_EQ(absorption(12, 10, 12), 0.01);
  EXPECT_EQ(absorption(8, 10, 8), 0.01);
  EXPECT_EQ(absorption(12, 10, 8), 0.01);
}

TEST_F(Painting, UndoAndRedoRestoreEveryBit) {
  const Material before = *block_;
  EditOptions soft = hard(Operation::kScale, 1.37);
  soft.softness = 0.7;
  apply(soft);
  const Material after = *block_;
  soft.quantity = Quantity::kReducedScattering;
  apply(soft);
  const Material last = *block_;
  EXPECT_TRUE(editor_.undo());
  EXPECT_EQ(*block_, after);
  EXPECT_TRUE(editor_.undo());
  EXPECT_EQ(*block_, before);
  EXPECT_FALSE(editor_.undo());
  EXPECT_TRUE(editor_.redo());
  EXPECT_TRUE(editor_.redo());
  EXPECT_FALSE(editor_.redo());
  EXPECT_EQ(*block_, last);
}

TEST_F(Painting, ANewStrokeEndsWhatCouldBeRedone) {
  apply(hard(Operation::kSet, 0.5));
  EXPECT_TRUE(editor_.undo());
  apply(hard(Operation::kSet, 0.7));
  EXPECT_FALSE(editor_.redo());
  EXPECT_EQ(editor_.history().undoable(), 1U);
}

TEST_F(Painting, TheHistoryForgetsTheOldestBeyondItsBound) {
  constexpr std::size_t kStroke = 81 * std::size_t{4 + 24};
  MaterialEditor editor(
      block_, {-10.0, -10.0, -10.0}, 1.0, [](Vec3) { return 0.0; }, 2 * kStroke + 10);
  for (int k = 1; k <= 5; ++k) ASSERT_TRUE(editor.apply(hard(Operation::kSet, 0.1 * k)));
  EXPECT_LE(editor.history().bytes(), 2 * kStroke + 10);
  EXPECT_TRUE(editor.undo());
  EXPECT_TRUE(editor.undo());
  EXPECT_FALSE(editor.undo());
  EXPECT_NEAR(absorption(10, 10, 10), 0.3, 1e-12);
}

TEST_F(Painting, WhatWasPaintedIsReadBackFromTheFile) {
  apply(hard(Operation::kPaint, 0.5));
  const auto file = directory_.path() / "painted.vdb";
  ASSERT_TRUE(write_material(system_files(), file, editor_.material(), "test"));
  const auto read = read_material(file);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_NEAR(read->channels[1].absorption[block_->block.index(10, 10, 10)], 1.0, 1e-7);
  EXPECT_NEAR(read->channels[1].absorption[block_->block.index(0, 0, 0)], 0.01, 1e-9);
}

TEST_F(Painting, NonsenseIsRefusedAndChangesNothing) {
  const Material before = *block_;
  EditOptions edit = hard(Operation::kScale, 0.0);
  EXPECT_THAT(editor_.apply(edit).error().message, HasSubstr("value has 0"));
  edit = hard(Operation::kSet, 0.5);
  edit.radius_mm = 0.0;
  EXPECT_THAT(editor_.apply(edit).error().message, HasSubstr("radius"));
  edit = hard(Operation::kSet, 0.5);
  edit.mask = directory_.path() / "none.png";
  EXPECT_FALSE(editor_.apply(edit));
  EXPECT_EQ(*block_, before);
}

}  // namespace
}  // namespace opaline::render
