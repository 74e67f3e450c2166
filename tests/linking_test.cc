// "Each program links only its own column" (docs/architecture.md): reads what the built programs need.

#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>

#include "tests/support/named_directory.h"
#include "tests/support/process.h"
#include "tests/support/temporary_directory.h"

namespace opaline {
namespace {

using ::testing::Contains;
using ::testing::IsSubsetOf;

/// Everybody's: the system, the sanitizers, and what base links.
const std::set<std::string> kEverybodys{"ld-linux-x86-64",
                                        "libasan",
                                        "libc",
                                        "libcrypto",
                                        "libfmt",
                                        "libgcc_s",
                                        "libm",
                                        "libspdlog",
                                        "libstdc++",
                                        "libtsan",
                                        "libubsan",
                                        "libz"};
const std::set<std::string> kPictures{"libOpenImageIO", "libOpenImageIO_Util"};
const std::set<std::string> kVolumes{"libImath-3_1", "libopenvdb", "libtbb"};
const std::set<std::string> kProcessor{"libhwy"};
const std::set<std::string> kWindows{"libglfw", "libstb", "libvulkan"};
const std::set<std::string> kUsb{"libusb-1.0"};
const std::set<std::string> kLenses{"libceres",
                                    "libglog",
                                    "libopencv_aruco",
                                    "libopencv_calib3d",
                                    "libopencv_core",
                                    "libopencv_dnn",
                                    "libopencv_features2d",
                                    "libopencv_flann",
                                    "libopencv_imgproc",
                                    "libopencv_mcc"};

/// A sample's holder is found by its markers.
const std::set<std::string> kBoards{
    "libopencv_aruco", "libopencv_calib3d", "libopencv_core", "libopencv_imgproc"};

std::set<std::string> join(std::initializer_list<std::set<std::string>> sets) {
  std::set<std::string> all;
  for (const auto& set : sets) all.insert(set.begin(), set.end());
  return all;
}

const std::map<std::string, std::set<std::string>> kMayLink{
    {"opaline", {"libcurl"}},
    {"opalined", {"libsqlite3"}},
    {"opaline-calibrate", join({kLenses, kPictures, kUsb})},
    {"opaline-capture", join({kBoards, kPictures, kUsb})},
    {"opaline-guardian", kUsb},
    {"opaline-preview", join({kPictures, kVolumes, kProcessor})},
    {"opaline-reconstruct", join({kPictures, kVolumes, kProcessor})},
    {"opaline-render", join({kPictures, kVolumes})},
    {"opaline-rig", {}},
    {"opaline-tradeoff", join({kPictures, kVolumes, kProcessor})},
    {"opaline-transport", {}},
    {"opaline-view", join({kPictures, kVolumes, kWindows})},
};

std::filesystem::path program(const std::string& name) {
  return opaline::testing::named_directory("OPALINE_BIN_DIR") / name;
}

/// What the program itself names (DT_NEEDED), without versions; what those libraries need is theirs.
std::set<std::string> linked_by(const std::string& name) {
  const testing::TemporaryDirectory directory;
  testing::Process readelf({"/usr/bin/readelf", "--dynamic", "--wide", program(name).string()},
                           {},
                           directory.path() / "out");
  EXPECT_EQ(readelf.wait(), 0);
  static const std::regex pattern(R"(\(NEEDED\).*\[(.+?)\.so)");
  const std::string text = readelf.output();
  std::set<std::string> found;
  for (std::sregex_iterator match(text.begin(), text.end(), pattern), end; match != end; ++match) {
    found.insert((*match)[1]);
  }
  return found;
}

TEST(Linking, EachProgramLinksOnlyItsOwnColumn) {
  for (const auto& [name, allowed] : kMayLink) {
    const auto linked = linked_by(name);
    EXPECT_THAT(linked, Contains("libc")) << name;  // it was read
    EXPECT_THAT(linked, IsSubsetOf(join({kEverybodys, allowed}))) << name;
  }
}

// The Vulkan loader is opened by name when a context is made, and not linked, except by the viewer, whose window needs it.
TEST(Linking, OnlyTheSolverTheTradeoffAndWhatDrawsKnowOfVulkan) {
  const std::set<std::string> knowing{"opaline-preview",
                                      "opaline-reconstruct",
                                      "opaline-render",
                                      "opaline-tradeoff",
                                      "opaline-view"};
  for (const auto& [name, ignored] : kMayLink) {
    std::ostringstream bytes;
    bytes << std::ifstream(program(name), std::ios::binary).rdbuf();
    const bool is_known = bytes.str().find("libvulkan.so") != std::string::npos;
    EXPECT_EQ(is_known, knowing.contains(name)) << name;
  }
}

}  // namespace
}  // namespace opaline
