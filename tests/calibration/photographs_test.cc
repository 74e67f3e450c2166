// OpenCV's photographs of a chessboard (Debian's opencv-doc), read as a folder of photographs is, against OpenCV's own
// calibration from the same corners.

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>
#include <opencv2/calib3d.hpp>
#include <vector>

#include "base/clock.h"
#include "calibration/board_finder.h"
#include "calibration/lens_fit.h"
#include "drivers/replay/replay_camera.h"
#include "tests/support/temporary_directory.h"

namespace opaline::calibration {
namespace {

namespace fs = std::filesystem;
using std::chrono::milliseconds;

const fs::path kPhotographs = "/usr/share/doc/opencv-doc/examples/data";
constexpr double kRounding = 1e-4;
constexpr int kWidth = 640;
constexpr int kHeight = 480;
const Board kBoard{.squares_x = 10, .squares_y = 7, .square_mm = 25.0};

/// left01.jpg to left14.jpg; there is no left10.jpg.
std::vector<std::string> names() {
  std::vector<std::string> all;
  for (int i = 1; i <= 14; ++i) {
    if (i != 10) all.push_back(fmt::format("left{:02}.jpg", i));
  }
  return all;
}

void write_index(const fs::path& folder) {
  std::ofstream index(folder / "index.toml");
  index << fmt::format(
      "[camera]\nmodel = \"OpenCV's\"\nwidth = {}\nheight = {}\nbit_depth = 8\n", kWidth, kHeight);
  for (const std::string& name : names()) {
    fs::create_symlink(kPhotographs / name, folder / name);
    index << fmt::format(
        "[[photograph]]\nfile = \"{}\"\npattern = \"{}\"\nexposure_s = 0.1\n", name, name);
  }
}

std::vector<BoardView> views_of_photographs() {
  const testing::TemporaryDirectory folder;
  write_index(folder.path());
  const SystemClock clock;
  drivers::ReplayCamera camera(folder.path(), clock);
  EXPECT_TRUE(camera.open());
  std::vector<BoardView> views;
  std::uint64_t pattern = 0;
  for (const std::string& name : names()) {
    const auto frame = camera.capture({milliseconds(100), ++pattern, name}, {});
    if (!frame) {
      ADD_FAILURE() << frame.error().message;
      return views;
    }
    auto view = find_board(grey_of(frame->pixels), kBoard, name);
    if (!view) {
      ADD_FAILURE() << view.error().message;
      return views;
    }
    views.push_back(*std::move(view));
  }
  return views;
}

struct Theirs {
  double rms = 0.0;
  cv::Mat matrix;
};

Theirs calibrate_with_opencv(const std::vector<BoardView>& views) {
  std::vector<std::vector<cv::Point3f>> board;
  std::vector<std::vector<cv::Point2f>> seen;
  for (const BoardView& view : views) {
    board.emplace_back();
    seen.emplace_back();
    for (const BoardCorner& corner : view.corners) {
      const Vec3 p = kBoard.corner(corner.id);
      board.back().emplace_back(static_cast<float>(p.x), static_cast<float>(p.y), 0.0f);
      seen.back().emplace_back(static_cast<float>(corner.pixel.x),
                               static_cast<float>(corner.pixel.y));
    }
  }
  Theirs theirs;
  cv::Mat distortion;
  std::vector<cv::Mat> turns;
  std::vector<cv::Mat> places;
  theirs.rms =
      cv::calibrateCamera(board, seen, {kWidth, kHeight}, theirs.matrix, distortion, turns, places);
  return theirs;
}

/// Found once for all tests: finding takes seconds.
const std::vector<BoardView>& views() {
  static const std::vector<BoardView> found = views_of_photographs();
  return found;
}

TEST(Photographs, TheBoardIsFoundInAllThirteen) {
  ASSERT_EQ(views().size(), 13U);
  for (const BoardView& view : views()) {
    EXPECT_EQ(view.fault, "") << view.name;
    EXPECT_EQ(view.corners.size(), 54U) << view.name;
  }
}

// Both minimise the same sum over the same corners, so ours may be larger by rounding (their corners are floats) alone.
TEST(Photographs, LeastSquaresOverAllCornersFitsThemNoWorseThanOpenCv) {
  const LensFitOptions all{.blurred = 1e9, .faint = 0.0, .worst_view = 1e9, .outlier = 0.0};
  const auto ours = fit_lens(kWidth, kHeight, kBoard, views(), all, {});
  ASSERT_TRUE(ours) << ours.error().message;
  const Theirs theirs = calibrate_with_opencv(views());
  EXPECT_EQ(ours->kept(), 13);
  EXPECT_LE(ours->rms_px, theirs.rms * (1.0 + kRounding));
  EXPECT_NEAR(ours->lens.fx / theirs.matrix.at<double>(0, 0), 1.0, 0.002);
  EXPECT_NEAR(ours->lens.fy / theirs.matrix.at<double>(1, 1), 1.0, 0.002);
  RecordProperty("ours_px", fmt::format("{}", ours->rms_px));
  RecordProperty("opencv_px", fmt::format("{}", theirs.rms));
}

TEST(Photographs, TheRobustFitKeepsNearlyAllAndAgreesWithOpenCv) {
  const auto ours = fit_lens(kWidth, kHeight, kBoard, views(), {}, {});
  ASSERT_TRUE(ours) << ours.error().message;
  const Theirs theirs = calibrate_with_opencv(views());
  for (const ViewFit& view : ours->views) EXPECT_EQ(view.reason, "") << view.name;
  EXPECT_LE(ours->outliers, 7);  // one in a hundred of 702
  EXPECT_LE(ours->rms_px, theirs.rms * (1.0 + kRounding));
  EXPECT_NEAR(ours->lens.fx / theirs.matrix.at<double>(0, 0), 1.0, 0.002);
  EXPECT_NEAR(ours->lens.fy / theirs.matrix.at<double>(1, 1), 1.0, 0.002);
  EXPECT_LT(ours->deviation[0] / ours->lens.fx, 0.005);
}

}  // namespace
}  // namespace opaline::calibration
