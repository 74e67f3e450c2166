#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"

namespace opaline::daemon {

/// `opaline render`: what is passed on to opaline-render.
struct RenderWish {
  std::string scene;
  std::vector<std::string> outputs;
  int turntable = 0;  ///< pictures of one turn; 0: one picture, as the scene stands
  std::string stats;  ///< file; empty: for people, to standard error
  int threads = 0;    ///< 0: one a processor
  std::vector<std::string> materials;  ///< OBJECT=FILE.vdb: to be saved with their edits
  std::string draw = "host";           ///< or vulkan
  std::string device;                  ///< part of a Vulkan device's name; empty: the best
  bool no_edits = false;
  bool at_rest = false;            ///< without bending
  bool swing = false;              ///< bends over a turntable
  std::string light = "constant";  ///< of a session's maps, as the rest
  double turn_deg = 0.0;
  double tilt_deg = 0.0;
  std::string mesh;
  double mesh_size_mm = 0.0;
};

/// Becomes `programs`/opaline-render. Errors: kUnavailable when the program is not there.
Error become_render(const std::filesystem::path& programs, const RenderWish& wish);

}  // namespace opaline::daemon
