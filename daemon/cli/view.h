#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"

namespace opaline::daemon {

/// `opaline view`: what is passed on to opaline-view, word by word.
struct ViewWish {
  std::string scene;
  std::vector<std::string> actions;
  int frames = 0;
  std::string screenshot;
  std::string step_pictures;
  int width = 1280;
  int height = 800;
  std::string device;
  bool validation = false;
  int threads = 0;
};

/// Becomes `programs`/opaline-view. Errors: kUnavailable when the program is not there.
Error become_view(const std::filesystem::path& programs, const ViewWish& wish);

}  // namespace opaline::daemon
