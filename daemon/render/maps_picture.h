#pragma once

#include <filesystem>
#include <functional>
#include <stop_token>
#include <string>
#include <vector>

#include "base/result.h"

namespace opaline::daemon {

/// `opaline render SESSION`: pictures of an object in a sphere of lights by its maps.
struct MapsPictureOptions {
  std::filesystem::path session;
  std::vector<std::filesystem::path>
      outputs;                     ///< .png, .tif or .exr (radiance over a white surface's)
  std::string light = "constant";  ///< or gradient_x, gradient_y, gradient_z
  double turn_deg = 0.0;           ///< of the object, to the right and up
  double tilt_deg = 0.0;
  int turntable = 0;           ///< pictures of one turn; 0: one picture
  std::filesystem::path mesh;  ///< OBJ with texture coordinates, in place of the seen surface
  double mesh_size_mm = 0.0;   ///< its largest extent; 0: its coordinates are mm
  bool is_asked_for() const {
    return light != "constant" || turn_deg != 0.0 || tilt_deg != 0.0 || !mesh.empty() ||
           mesh_size_mm != 0.0;
  }
};

/// The captured view: what the camera saw beside the same by texture-space diffusion. Another one: by screen-space diffusion, beside what the camera saw unless it
/// is of a mesh or a turntable. `told` hears of each picture's file.
/// Errors: those of MapsScene::open; kInvalidArgument for another ending; the file system's; kCancelled.
Result<void> draw_maps(const MapsPictureOptions& options,
                       const std::function<void(const std::filesystem::path&)>& told,
                       std::stop_token stop);

}  // namespace opaline::daemon
