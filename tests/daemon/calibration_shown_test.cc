// What an operator is shown while a calibration goes on.

#include <gmock/gmock.h>

#include "base/io/image_io.h"
#include "daemon/calibrate/calibration_terminal.h"
#include "daemon/calibrate/live_attendant.h"
#include "daemon/calibrate/pose_picture.h"
#include "daemon/calibrate/view_frame.h"
#include "tests/support/temporary_directory.h"

namespace opaline::daemon {
namespace {

using ::testing::HasSubstr;

TEST(PoseLines, DrawTheCoverageAndNameTheNextPose) {
  std::vector<int> fields(48, 0);
  fields[0] = 3;
  fields[47] = 1;
  const auto lines = pose_lines(
      {{"message",
        "pose 3: 54 corners; corners in 4 % of the picture; next: the board towards the top"},
       {"fields", fields},
       {"tilts", {{"left", 2}, {"flat", 1}}}});
  ASSERT_EQ(lines.size(), 8U);
  EXPECT_EQ(lines[0], "pose 3: 54 corners; corners in 4 % of the picture");
  EXPECT_THAT(lines[1], HasSubstr("# . . . . . . . "));
  EXPECT_THAT(lines[2], HasSubstr(". . . . . . . .     2 left"));
  EXPECT_THAT(lines[6], HasSubstr(". . . . . . . # "));
  EXPECT_EQ(lines[7], "  next: the board towards the top");
}

TEST(PosePicture, MarksCornersAndWhatIsNotCovered) {
  const Image<std::uint8_t> grey(160, 120, 1, 100);
  calibration::BoardView board;
  board.corners = {{0, {50.5, 40.5}}};
  calibration::PoseGuide guide;
  guide.fields[9] = 1;  // of the second row
  const auto picture = pose_picture(grey, board, guide, 960);
  EXPECT_EQ(picture.at(50, 40, 1), 230) << "the corner";
  EXPECT_EQ(picture.at(1, 1, 0), 230) << "an edge of the first field, which nothing covers";
  EXPECT_EQ(picture.at(30, 21, 0), 100) << "the upper edge of the field that is covered";
  EXPECT_EQ(pose_picture(grey, board, guide, 80).width(), 80);
}

TEST(ContactSheet, PutsPicturesInRows) {
  const auto sheet = contact_sheet({5, Image<std::uint8_t>(30, 20, 3, 7)}, 3);
  EXPECT_EQ(sheet.width(), 3 * 34 - 4);
  EXPECT_EQ(sheet.height(), 2 * 24 - 4);
  EXPECT_EQ(sheet.at(34, 24, 0), 7);
  EXPECT_EQ(sheet.at(32, 0, 0), 255);
}

TEST(ViewFrame, KeepsASaturatedPixelWhenThePictureIsShrunk) {
  Image<std::uint16_t> picture(8, 4, 1, 100);
  picture.at(5, 2) = 4095;
  const auto small = shrunk_codes(picture, 2, 4000.0);
  EXPECT_EQ(small.width(), 2);
  EXPECT_EQ(small.at(0, 0), 100);
  EXPECT_EQ(small.at(1, 0), 4095);
}

TEST(LiveAttendant, ShowsAFrameWithItsFiguresAndKeepsAPictureOfAPose) {
  const testing::TemporaryDirectory directory;
  const auto live = LiveView::create(system_files(), directory.path() / "live");
  ASSERT_TRUE(live) << live.error().message;
  LiveAttendant attendant({.live = live->get(), .poses = directory.path() / "poses", .version = 4},
                          system_files());
  attendant.doing("linearity", "exposure 3");
  Frame frame;
  frame.pixels = Image<std::uint16_t>(32, 24, 3, 1000);
  attendant.saw(frame);
  const auto figures = nlohmann::json::parse(*read_text((*live)->directory() / "view.json"));
  EXPECT_EQ(figures["step"], "linearity");
  EXPECT_EQ(figures["version"], 4);
  EXPECT_EQ(figures["frame"], 1);
  EXPECT_TRUE(figures.contains("histogram"));

  const Image<std::uint8_t> grey(32, 24, 1, 90);
  calibration::BoardView board;
  board.fault = "no board found";
  attendant.saw({grey, board, calibration::PoseGuide(), 3, 16, true, "taken"});
  const auto pose = nlohmann::json::parse(*read_text((*live)->directory() / "view.json"));
  EXPECT_EQ(pose["board"]["fault"], "no board found");
  EXPECT_TRUE(std::filesystem::exists(directory.path() / "poses" / "pose_03.png"));
}

}  // namespace
}  // namespace opaline::daemon
