#include "daemon/session_camera.h"

#include <gmock/gmock.h>

#include "tests/support/temporary_directory.h"

namespace opaline::daemon {
namespace {

using ::testing::HasSubstr;

class SessionCamera : public ::testing::Test {
 protected:
  static CameraModel measured() {
    CameraModel camera{.width = 400,
                       .height = 300,
                       .fx = 2500.25,
                       .fy = 2499.75,
                       .cx = 201.5,
                       .cy = 148.25,
                       .distortion = {-0.08, 0.02, 1e-4, -1e-4, 1.0 / 3.0},
                       .camera_from_sample = {}};
    camera.camera_from_sample = look_at({50.0, 10.0, 300.0}, {12.0, 12.0, 6.0}, {0.0, 1.0, 0.0});
    return camera;
  }
  testing::TemporaryDirectory directory_;
  SessionDirectory session_ =
      *SessionDirectory::create(system_files(), directory_.path() / "session", {});
};

TEST_F(SessionCamera, IsTheMeasuredOneToTheLastBit) {
  ASSERT_TRUE(keep_camera(session_, system_files(), measured()));
  EXPECT_EQ(session_camera(session_, {}).value(), measured());
}

TEST_F(SessionCamera, IsTheRigFilesWhereNoneWasMeasured) {
  EXPECT_EQ(session_camera(session_, measured()).value(), measured());
}

TEST_F(SessionCamera, OfADamagedFileIsAnErrorThatNamesIt) {
  ASSERT_TRUE(keep_camera(session_, system_files(), measured()));
  const auto file = session_.calibration().parent_path() / "camera.json";
  ASSERT_TRUE(write_whole(system_files(), file, std::string(R"({"format": 1, "width": 400})")));
  const auto camera = session_camera(session_, {});
  ASSERT_FALSE(camera);
  EXPECT_THAT(camera.error().message, HasSubstr("camera.json: damaged"));
}

}  // namespace
}  // namespace opaline::daemon
