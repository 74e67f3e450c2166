#include "daemon/runtime_paths.h"

#include <gmock/gmock.h>

#include <cstdlib>

#include "daemon/driver_table.h"
#include "tests/support/temporary_directory.h"

namespace opaline::daemon {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class RuntimeDirectory : public ::testing::Test {
 protected:
  RuntimeDirectory() { ::setenv("XDG_RUNTIME_DIR", root_.path().c_str(), 1); }

  testing::TemporaryDirectory root_;
  fs::path directory_ = root_.path() / "opaline";
};

TEST_F(RuntimeDirectory, IsMadeForThisUserAlone) {
  const auto made = runtime_directory();

  ASSERT_TRUE(made) << made.error().message;
  EXPECT_EQ(*made, directory_);
  EXPECT_EQ(fs::status(directory_).permissions(), fs::perms::owner_all);
}

TEST_F(RuntimeDirectory, ThatOthersCanWriteToIsRefused) {
  fs::create_directory(directory_);
  fs::permissions(directory_, fs::perms::all);

  EXPECT_FALSE(runtime_directory());
}

TEST_F(RuntimeDirectory, ThatIsALinkIsRefused) {
  fs::create_directory(root_.path() / "elsewhere");
  fs::create_directory_symlink(root_.path() / "elsewhere", directory_);

  EXPECT_FALSE(runtime_directory());
}

TEST_F(RuntimeDirectory, ThatIsNotOursServesNoSimulatedStation) {
  fs::create_directory(directory_);
  fs::permissions(directory_, fs::perms::all);
  config::RigConfig rig;
  rig.camera = rig.projector = config::Driver::kSim;
  rig.sim.run = config::RigPlace::kProcess;
  NullSink nobody;

  const auto devices = StationDevices::create(rig, root_.path(), nobody, {});

  ASSERT_FALSE(devices);
  EXPECT_THAT(devices.error().message, HasSubstr("not this user's own directory"));
}

}  // namespace
}  // namespace opaline::daemon
