#pragma once

#include <array>
#include <stop_token>

#include "base/image.h"
#include "base/result.h"
#include "base/surface_reflectance.h"
#include "daemon/report/hdr_picture.h"
#include "reconstruct/diffusion/fluence_solver.h"
#include "render/renderer.h"
#include "render/translucency.h"

namespace opaline::daemon {

struct ReportData;

/// The sample under uniform light, camera pixels, W/(mm^2 sr), 3 channels each; and what its surface reflects.
struct SurfaceView {
  Image<float> captured;
  Image<float> material;  ///< the material alone
  Image<float> relit;     ///< with what the surface reflects
  SurfaceReflectance surface;
  std::array<double, 3> median{};  ///< of rho_s, measured cells, 1/sr
  /// ||rho_s - truth|| / ||truth|| over measured cells at least `kRim` cells from the edge; of a simulated sample, else 0.
  std::array<double, 3> error{};
  bool has_truth = false;

  static constexpr int kRim = 2;
};

/// Draws the session's material under the picture's uniform light, with and without the surface.
Result<SurfaceView> surface_view(render::Renderer& renderer,
                                 const ReportData& data,
                                 SurfaceReflectance surface,
                                 HdrPicture captured,
                                 const render::TranslucencyOptions& options,
                                 reconstruct::diffusion::FluenceSolver& solver,
                                 std::stop_token stop);

}  // namespace opaline::daemon
