#pragma once

#include <string>
#include <vector>

#include "base/result.h"
#include "daemon/scattering/sphere_maps.h"
#include "daemon/scattering/sphere_session.h"

namespace opaline::daemon {

/// The seen surface as heights over its outline's plane, on every `step`-th pixel: what the normals add up to, by least squares
///
///   min sum (z_b - z_a - h s_ab)^2,     s the slope -n_x/n_z, -n_y/n_z between neighbours a and b, h their distance
///
/// by over-relaxation; each connected part's lowest place is at 0. Towards the camera; NaN where nothing was measured.
struct Relief {
  int width = 0;
  int height = 0;
  int step = 1;          ///< pixels
  double cell_mm = 0.0;  ///< step times pixel_mm
  std::vector<float> height_mm;
  bool has(int x, int y) const;
  std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
           static_cast<std::size_t>(x);
  }
  float at(int x, int y) const { return height_mm[index(x, y)]; }
};
Relief relief_of(const SphereMaps& maps, const SphereSession& session, int most_cells = 128);

/// One channel on the relief's places; where the maps have no answer, the nearest that has one.
struct ReliefMaps {
  std::vector<float> absorption;
  std::vector<float> reduced_scattering;
  std::vector<float> translucency;
  std::vector<float> reduced_albedo;
  std::vector<float> diffusion;
};
/// Errors: kInvalidArgument where no pixel has an answer.
Result<ReliefMaps> nearest_maps(const Relief& relief, const reconstruct::ScatteringMaps& maps);

/// A closed mesh of it, its back the front mirrored, with texture coordinates over the picture (OBJ, mm).
std::string relief_obj(const Relief& relief);

}  // namespace opaline::daemon
