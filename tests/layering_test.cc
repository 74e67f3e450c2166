// Holds the layer table of docs/architecture.md: reads every #include of the project's own files, and which library uses
// which in the CMakeLists.txt beside them.

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/named_directory.h"

namespace opaline {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::UnorderedElementsAre;

// What the files of each directory may include; a file belongs to the longest prefix. Base is
// everybody's.
const std::map<std::string, std::set<std::string>> kMayInclude{
    {"base", {}},
    {"base/io", {}},
    {"gpu", {}},
    {"drivers", {"base/io"}},
    {"sim", {"base/io", "drivers"}},
    {"capture", {"base/io", "drivers"}},
    {"calibration", {"base/io", "drivers", "capture"}},
    {"reconstruct/diffusion", {}},
    {"reconstruct", {"base/io", "gpu", "reconstruct/diffusion"}},
    {"render", {"base/io", "gpu", "reconstruct/diffusion"}},
    {"config",
     {"base/io",
      "drivers",
      "sim",
      "capture",
      "calibration",
      "gpu",
      "reconstruct",
      "reconstruct/diffusion",
      "render"}},
    {"daemon",
     {"base/io",
      "drivers",
      "sim",
      "capture",
      "calibration",
      "gpu",
      "reconstruct",
      "reconstruct/diffusion",
      "render",
      "config"}},
};

// The only users of a library: header prefix -> the directory that may include it.
const std::map<std::string, std::vector<std::string>> kOnlyUsers{
    {"openvdb/", {"base/io", "tests/base/io"}},
    {"OpenImageIO/", {"base/io"}},
    {"vulkan/", {"gpu", "daemon/view"}},
    {"GLFW/", {"daemon/view"}},
    {"imgui.h", {"daemon/view"}},
    {"backends/imgui", {"daemon/view"}},
    {"boost/", {"daemon", "sim"}},
    {"sqlite3.h", {"daemon"}},
    {"toml++/", {"config", "drivers"}},
    {"spdlog/", {"base"}},
    {"Eigen/", {"reconstruct", "calibration", "sim", "tests", "bench"}},
    {"opencv2/", {"calibration"}},
    {"ceres/", {"calibration"}},
    {"hwy/", {"reconstruct", "sim"}},
    {"CLI/", {"daemon", "bench"}},
    {"Imath/", {"base/io"}},
    {"tbb/", {"base/io"}},
    {"oneapi/", {"base/io"}},
    {"curl/", {"daemon"}},
    {"openssl/", {"base"}},
    {"libusb-1.0/", {"drivers"}},
    {"zlib.h", {"base"}},
};

struct Include {
  std::string file;
  int line = 0;
  std::string header;
  bool ours = false;  // "..." and not <...>
};

fs::path source_root() { return opaline::testing::named_directory("OPALINE_SOURCE_DIR"); }

std::vector<Include> includes_of(const fs::path& path, const std::string& name) {
  static const std::regex pattern(R"(^\s*#\s*include\s*([<"])([^>"]+)[>"])");
  std::vector<Include> found;
  std::ifstream file(path);
  std::string text;
  for (int line = 1; std::getline(file, text); ++line) {
    std::smatch match;
    if (std::regex_search(text, match, pattern)) {
      found.push_back({name, line, match[2].str(), match[1].str() == "\""});
    }
  }
  return found;
}

std::vector<Include> all_includes() {
  std::vector<Include> all;
  for (const char* top : {"base",
                          "gpu",
                          "drivers",
                          "sim",
                          "capture",
                          "calibration",
                          "reconstruct",
                          "render",
                          "config",
                          "daemon",
                          "tests",
                          "bench"}) {
    for (const auto& entry : fs::recursive_directory_iterator(source_root() / top)) {
      const std::string extension = entry.path().extension().string();
      if (extension != ".h" && extension != ".cc" && extension != ".inc") continue;
      const auto found =
          includes_of(entry.path(), fs::relative(entry.path(), source_root()).string());
      all.insert(all.end(), found.begin(), found.end());
    }
  }
  return all;
}

bool is_under(const std::string& path, const std::string& directory) {
  return path.starts_with(directory + "/");
}

std::string layer_of(const std::string& path) {
  std::string best;
  for (const auto& [layer, ignored] : kMayInclude) {
    if (is_under(path, layer) && layer.size() > best.size()) best = layer;
  }
  return best;
}

std::string at(const Include& include) {
  return include.file + ":" + std::to_string(include.line) + " includes " + include.header;
}

bool may_see(const std::string& from, const std::string& to) {
  return to == from || to == "base" || kMayInclude.at(from).contains(to);
}

/// Includes that point up or sideways; tests and benchmarks see everything.
std::vector<std::string> wrong_layers(const std::vector<Include>& includes) {
  std::vector<std::string> wrong;
  for (const Include& include : includes) {
    const std::string from = layer_of(include.file);
    const std::string to = layer_of(include.header);
    if (from.empty() || to.empty() || !include.ours || may_see(from, to)) continue;
    wrong.push_back(fmt::format("{}: {} may not see {}", at(include), from, to));
  }
  return wrong;
}

std::vector<std::string> wrong_third_parties(const std::vector<Include>& includes) {
  std::vector<std::string> wrong;
  for (const Include& include : includes) {
    if (include.ours || is_under(include.file, "tests")) continue;
    for (const auto& [prefix, users] : kOnlyUsers) {
      const bool allowed = std::ranges::any_of(
          users, [&](const std::string& user) { return is_under(include.file, user); });
      if (include.header.starts_with(prefix) && !allowed) wrong.push_back(at(include));
    }
  }
  return wrong;
}

/// A library or program of a CMakeLists.txt: opaline_library(NAME SOURCES ... USES ...).
struct Target {
  std::string name;
  std::string layer;
  std::vector<std::string> uses;
};

std::string text_of(const fs::path& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return std::regex_replace(text.str(), std::regex("#[^\n]*"), "");
}

Target parse_target(const std::string& arguments, const std::string& directory) {
  Target target;
  std::istringstream words(arguments);
  words >> target.name;
  std::string list;
  for (std::string word; words >> word;) {
    if (word == "SOURCES" || word == "USES" || word == "LINK" || word == "PUBLIC_LINK") {
      list = word;
    } else if (list == "USES") {
      target.uses.push_back(word);
    } else if (list == "SOURCES" && target.layer.empty()) {
      target.layer = layer_of(fmt::format("{}/{}", directory, word));
    }
  }
  if (target.layer.empty()) target.layer = layer_of(directory + "/");
  return target;
}

std::vector<Target> targets_in(const std::string& cmake, const std::string& directory) {
  static const std::regex pattern(
      R"((opaline_library|opaline_program)\(([^)]*)\)|add_library\(opaline_(\w+))");
  std::vector<Target> targets;
  for (std::sregex_iterator match(cmake.begin(), cmake.end(), pattern), end; match != end;
       ++match) {
    targets.push_back(parse_target((*match)[2].matched ? (*match)[2] : (*match)[3], directory));
  }
  return targets;
}

std::vector<Target> all_targets() {
  std::vector<Target> all;
  for (const auto& [layer, ignored] : kMayInclude) {
    const fs::path file = source_root() / layer / "CMakeLists.txt";
    if (!fs::exists(file)) continue;
    for (Target& target : targets_in(text_of(file), layer)) all.push_back(std::move(target));
  }
  return all;
}

std::vector<std::string> wrong_uses(const std::vector<Target>& targets) {
  std::map<std::string, std::string> layers;
  for (const Target& target : targets) layers[target.name] = target.layer;
  std::vector<std::string> wrong;
  for (const Target& target : targets) {
    for (const std::string& used : target.uses) {
      if (!layers.contains(used)) {
        wrong.push_back(fmt::format("{} uses {}, which no directory has", target.name, used));
      } else if (!may_see(target.layer, layers[used])) {
        wrong.push_back(
            fmt::format("{} of {} uses {} of {}", target.name, target.layer, used, layers[used]));
      }
    }
  }
  return wrong;
}

TEST(Layering, EveryIncludePointsDownTheTable) {
  const auto all = all_includes();
  ASSERT_GT(all.size(), 100U);  // it did read the sources
  EXPECT_THAT(wrong_layers(all), IsEmpty());
}

TEST(Layering, AnIncludeThatPointsSidewaysOrUpIsFound) {
  EXPECT_THAT(wrong_layers({{"capture/sequence.cc", 7, "sim/rig.h", true},
                            {"sim/photon_step.inc", 3, "reconstruct/diffusion/fresnel.h", true},
                            {"base/image.h", 1, "gpu/image.h", true},
                            {"capture/sequence.cc", 8, "drivers/camera.h", true},
                            {"tests/sim/rig_test.cc", 1, "reconstruct/objective.h", true}}),
              ElementsAre("capture/sequence.cc:7 includes sim/rig.h: capture may not see sim",
                          HasSubstr("photon_step.inc:3"),
                          HasSubstr("base may not see gpu")));
}

TEST(Layering, OurOwnHeadersAreIncludedFromTheRepositoryRoot) {
  for (const Include& include : all_includes()) {
    if (!include.ours || include.header.ends_with("_shaders.h")) continue;
    EXPECT_TRUE(fs::exists(source_root() / include.header)) << at(include);
  }
}

TEST(Layering, ThirdPartiesAreIncludedOnlyByTheirOneUser) {
  EXPECT_THAT(wrong_third_parties(all_includes()), IsEmpty());
  EXPECT_THAT(wrong_third_parties({{"capture/sequence.cc", 7, "openvdb/openvdb.h", false},
                                   {"base/io/volume_io.cc", 7, "openvdb/openvdb.h", false}}),
              ElementsAre("capture/sequence.cc:7 includes openvdb/openvdb.h"));
}

TEST(Layering, EveryLibraryUsesOnlyThoseBelowIt) {
  const auto all = all_targets();
  ASSERT_GT(all.size(), 20U);
  EXPECT_THAT(wrong_uses(all), IsEmpty());
}

TEST(Layering, ALibraryThatUsesItsSiblingIsFound) {
  auto targets = targets_in("opaline_library(rig SOURCES rig.cc USES base LINK x::y)", "sim");
  for (const Target& target :
       targets_in("opaline_library(base SOURCES log.cc)\n"
                  "opaline_library(taker\n  SOURCES taker.cc\n  USES base rig unheard_of)",
                  "capture")) {
    targets.push_back(target);
  }
  EXPECT_THAT(wrong_uses(targets),
              UnorderedElementsAre("rig of sim uses base of capture",
                                   "taker of capture uses rig of sim",
                                   HasSubstr("unheard_of")));
}

}  // namespace
}  // namespace opaline
