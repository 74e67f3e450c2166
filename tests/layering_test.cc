// Holds the layer table of docs/architecture.md: reads every #include of the project's own files.

#include <gmock/gmock.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <string>
#include <vector>

namespace opaline {
namespace {

namespace fs = std::filesystem;

// What the files of each directory may include; a file belongs to the longest prefix. Base is
// everybody's.
const std::map<std::string, std::set<std::string>> kMayInclude{
    {"base", {}},
    {"base/io", {}},
    {"gpu", {}},
    {"drivers", {"base/io"}},
    {"sim", {"base/io", "drivers"}},
    {"capture", {"base/io", "drivers"}},
    {"reconstruct/diffusion", {}},
    {"reconstruct", {"base/io", "gpu", "reconstruct/diffusion"}},
    {"render", {"base/io", "gpu", "reconstruct/diffusion"}},
    {"config",
     {"base/io",
      "drivers",
      "sim",
      "capture",
      "gpu",
      "reconstruct",
      "reconstruct/diffusion",
      "render"}},
    {"daemon",
     {"base/io",
      "drivers",
      "sim",
      "capture",
      "gpu",
      "reconstruct",
      "reconstruct/diffusion",
      "render",
      "config"}},
};

// The only users of a library: header prefix -> the directory that may include it.
const std::map<std::string, std::vector<std::string>> kOnlyUsers{
    {"openvdb/", {"base/io"}},
    {"OpenImageIO/", {"base/io"}},
    {"vulkan/", {"gpu"}},
    {"boost/", {"daemon", "sim"}},
    {"sqlite3.h", {"daemon"}},
    {"toml++/", {"config", "drivers"}},
    {"spdlog/", {"base"}},
    {"Eigen/", {"reconstruct", "tests", "bench"}},
    {"hwy/", {"reconstruct", "sim"}},
    {"CLI/", {"daemon", "bench"}},
};

struct Include {
  std::string file;
  int line = 0;
  std::string header;
  bool ours = false;  // "..." and not <...>
};

fs::path source_root() { return std::getenv("OPALINE_SOURCE_DIR"); }

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
                          "reconstruct",
                          "render",
                          "config",
                          "daemon",
                          "tests",
                          "bench"}) {
    for (const auto& entry : fs::recursive_directory_iterator(source_root() / top)) {
      const std::string extension = entry.path().extension().string();
      if (extension != ".h" && extension != ".cc") continue;
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

TEST(Layering, EveryIncludePointsDownTheTable) {
  const auto all = all_includes();
  ASSERT_GT(all.size(), 100U);  // it did read the sources
  for (const Include& include : all) {
    const std::string from = layer_of(include.file);
    const std::string to = layer_of(include.header);
    if (from.empty() || to.empty() || !include.ours)
      continue;  // tests and benchmarks see everything
    EXPECT_TRUE(to == from || to == "base" || kMayInclude.at(from).contains(to))
        << at(include) << ": " << from << " may not see " << to;
  }
}

TEST(Layering, OurOwnHeadersAreIncludedFromTheRepositoryRoot) {
  for (const Include& include : all_includes()) {
    if (!include.ours || include.header.ends_with("_shaders.h")) continue;
    EXPECT_TRUE(fs::exists(source_root() / include.header)) << at(include);
  }
}

TEST(Layering, ThirdPartiesAreIncludedOnlyByTheirOneUser) {
  for (const Include& include : all_includes()) {
    if (include.ours || is_under(include.file, "tests")) continue;
    for (const auto& [prefix, users] : kOnlyUsers) {
      if (!include.header.starts_with(prefix)) continue;
      const bool allowed = std::any_of(users.begin(), users.end(), [&](const std::string& user) {
        return is_under(include.file, user);
      });
      EXPECT_TRUE(allowed) << at(include);
    }
  }
}

}  // namespace
}  // namespace opaline
