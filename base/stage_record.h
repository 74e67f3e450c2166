#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "base/light_sphere.h"
#include "base/pose.h"

namespace opaline {

/// One pattern of a light stage as it was photographed: hdr/NAME.exr of the session.
struct StagePicture {
  std::string name;
  std::vector<std::uint8_t> codes;  ///< one a light, 0 to 255, light is proportional
  bool parallel = false;            ///< polarisers: parallel instead of crossed
  double scale = 1.0;               ///< of the lamps against the first picture, as they drift
};

/// What a captured sphere of lights was, and how its pictures lie in it. The pictures' own directions are `axes`: along a row, down a column,
/// towards the camera.
struct StageRecord {
  std::vector<SphereLight> lights;
  std::array<Vec3, 3> axes{
      Vec3{1, 0, 0}, Vec3{0, -1, 0}, Vec3{0, 0, 1}};  ///< in the sphere's frame
  Vec3 middle;            ///< what `middle_x`, `middle_y` see on the object's plane, mm
  double middle_x = 0.0;  ///< pixels
  double middle_y = 0.0;
  double pixel_mm = 0.1;  ///< of a pixel on that plane
  double distance_mm =
      0.0;  ///< of the camera from that plane; 0: so far that it sees no perspective
  double depolarised = 0.5;  ///< share of depolarised light that passes the crossed polarisers
  double drift = 0.0;        ///< relative change of the lamps from the first picture to the last
  bool split = false;        ///< gradients as two halves instead of shifted
  std::vector<StagePicture> pictures;

  const StagePicture* find(std::string_view name) const {
    for (const StagePicture& picture : pictures)
      if (picture.name == name) return &picture;
    return nullptr;
  }
};

}  // namespace opaline
