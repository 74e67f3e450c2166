#pragma once

#include <filesystem>
#include <span>
#include <stop_token>

#include "base/image.h"
#include "base/result.h"
#include "daemon/scattering/relief.h"
#include "daemon/scattering/sphere_maps.h"
#include "render/dipole/mesh_texels.h"

namespace opaline::daemon {

/// What is drawn where the view differs from the captured one: the maps on the seen surface itself, or on any mesh with texture coordinates.
struct TurnedViewOptions {
  std::filesystem::path mesh;  ///< OBJ with coordinates over the picture; empty: the relief
  double mesh_size_mm = 0.0;   ///< its largest extent; 0: its coordinates are mm
  double turn_deg = 35.0;      ///< about the vertical, to the right
  double tilt_deg = 0.0;       ///< then about the horizontal, up
  int most_pixels = 144;       ///< of the longer side
};

/// Radiance over a white surface's, red green blue, 0 where nothing is seen.
struct TurnedPictures {
  Image<float> even;       ///< under constant light
  Image<float> from_left;  ///< under (1 - x)/2, x to the viewer's right
  double pixel_mm = 0.0;
};

/// The options' mesh in mm, or the relief's. Errors: kNotFound; kInvalidArgument for a damaged one.
Result<render::TexturedMesh> mesh_of(const Relief& relief, const TurnedViewOptions& options);
/// Turned, and moved into the middle of a picture that holds it.
render::ParallelView view_of(const render::TexturedMesh& mesh, const TurnedViewOptions& options);
/// Into one picture of the view's size for each light, by screen-space diffusion; x to the right, y up, z towards the eye.
Result<void> draw_in_screen_space(const SphereMaps& maps,
                                  const Relief& relief,
                                  double ior,
                                  const render::TexturedMesh& mesh,
                                  const render::ParallelView& view,
                                  std::span<const render::LinearLight> lights,
                                  std::span<Image<float>* const> pictures,
                                  std::stop_token stop);

/// Screen-space diffusion (render/dipole/mesh_texels.h). Errors: kNotFound; kInvalidArgument for a damaged mesh, or where some channel has no answer; kCancelled.
Result<TurnedPictures> turned_view(const SphereMaps& maps,
                                   const SphereSession& session,
                                   const TurnedViewOptions& options,
                                   double ior,
                                   std::stop_token stop);

/// The captured view, by screen-space diffusion of the relief, on the relief's places: what dipole_views draws in texture space. Errors: as above.
Result<Image<float>> captured_view_in_screen_space(const SphereMaps& maps,
                                                   const Relief& relief,
                                                   double ior,
                                                   std::stop_token stop);

}  // namespace opaline::daemon
