#pragma once

#include <array>
#include <filesystem>
#include <stop_token>
#include <string>

#include "base/image.h"
#include "base/result.h"
#include "daemon/scattering/relief.h"
#include "daemon/scattering/sphere_maps.h"
#include "daemon/scattering/sphere_session.h"
#include "daemon/scattering/turned_view.h"
#include "render/dipole/mesh_texels.h"

namespace opaline::daemon {

/// Whether a path is a directory, so a session whose maps `opaline render` and `opaline view` draw, and no scene file.
bool is_session_directory(const std::filesystem::path& path);

/// "constant", "gradient_x", "gradient_y", "gradient_z" as L(omega), of mean radiance 1 or 1/2; x to the right, y down a column, z towards the camera, as in the
/// session's pictures. Errors: kInvalidArgument.
Result<render::LinearLight> light_of_pattern(const std::string& name);

/// The object of a session in a sphere of lights as its maps say, and as it was captured, under any light that is linear in its direction (axes of
/// light_of_pattern). Pictures are radiance over a white surface's, red green blue, 0 where nothing is seen.
/// Threads: one call at a time.
class MapsScene {
 public:
  /// Errors: kNotFound; kInvalidArgument for a session without maps, a damaged mesh, or where some channel has no answer.
  static Result<MapsScene> open(const std::filesystem::path& session,
                                const TurnedViewOptions& options);
  /// The same of what was read. Errors: as above.
  static Result<MapsScene> make(SphereSession session,
                                SphereMaps maps,
                                double ior,
                                std::string name,
                                const TurnedViewOptions& options);

  /// What the camera saw, on the relief's places: the four pictures' sum for that light, since light adds.
  Image<float> captured(const render::LinearLight& light) const;
  /// The same view from the maps: dipoles summed over the seen surface (texture space). Four sums the first time, and none after it.
  Result<Image<float>> rendered(const render::LinearLight& light, std::stop_token stop);
  /// The object turned to the right and up before lights that stand still, by screen-space diffusion; the mesh of the options in place of the object where there
  /// is one. `most_pixels` of its longer side.
  Result<Image<float>> turned(double right_deg,
                              double up_deg,
                              const render::LinearLight& light,
                              int most_pixels,
                              std::stop_token stop) const;
  const std::string& name() const { return name_; }
  bool has_mesh() const { return has_mesh_; }  ///< so that no view of it was captured

 private:
  MapsScene(SphereSession session, SphereMaps maps, double ior, std::string name);
  Result<void> sum_dipoles(const std::stop_token& stop);

  SphereSession session_;
  SphereMaps maps_;
  Relief relief_;
  double ior_;
  std::string name_;
  bool has_mesh_ = false;
  render::TexturedMesh mesh_;
  std::array<Image<float>, 4> captured_;  // under constant light, and what x, y, z add to it
  std::array<Image<float>, 4> rendered_;
};

}  // namespace opaline::daemon
