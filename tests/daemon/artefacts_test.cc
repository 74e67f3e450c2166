#include "daemon/artefacts.h"

#include <gtest/gtest.h>

#include <fstream>
#include <thread>

#include "base/files.h"
#include "tests/support/temporary_directory.h"

namespace opaline::daemon {
namespace {

namespace fs = std::filesystem;

TEST(Artefacts, AreListedWhileDirectoriesComeAndGo) {
  const testing::TemporaryDirectory root;
  const auto session =
      SessionDirectory::create(system_files(), root.path() / "s", {"s", "", "", ""});
  ASSERT_TRUE(session);
  std::jthread restless([&](const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      std::error_code ignored;
      fs::create_directories(session->path() / "a" / "b" / "c", ignored);
      fs::remove_all(session->path() / "a", ignored);
    }
  });
  for (int i = 0; i < 2000; ++i) {
    const auto artefacts = list_artefacts(*session);
    ASSERT_TRUE(artefacts) << artefacts.error().message;
    ASSERT_GE(artefacts->size(), 4U);
  }
}

TEST(Artefacts, AreNamedFromTheSessionsDirectoryAndSorted) {
  const testing::TemporaryDirectory root;
  const auto session =
      SessionDirectory::create(system_files(), root.path() / "s", {"s", "", "", ""});
  ASSERT_TRUE(session);
  fs::create_directories(session->path() / "hdr" / ".hidden");
  std::ofstream(session->path() / "hdr" / "a.exr") << "123";
  std::ofstream(session->path() / "hdr" / ".hidden" / "b.exr") << "4";

  const auto artefacts = *list_artefacts(*session);

  EXPECT_EQ(artefacts.front().name, "hdr/a.exr");
  EXPECT_EQ(artefacts.front().size, 3U);
  EXPECT_EQ(artefacts.size(), 5U);  // and the four of which a session is made
}

}  // namespace
}  // namespace opaline::daemon
