#pragma once

#include <cstdint>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "base/camera_model.h"
#include "base/dataset.h"
#include "base/image.h"
#include "base/result.h"
#include "daemon/report/error_sums.h"
#include "daemon/report/hdr_picture.h"
#include "render/renderer.h"
#include "render/surface_field.h"

namespace opaline::daemon {

/// A held-out light as captured and as the material is rendered under it, camera pixels.
struct RelitLight {
  std::string name;
  Image<float> captured;       ///< 3 channels, W/(mm^2 sr)
  Image<float> relit;          ///< the same
  Image<std::uint8_t> counts;  ///< 1: the pixel takes part in the error
  ChannelErrors errors;

  /// No pixel takes part: the light could not be used.
  bool is_empty() const { return !(errors.all().signal > 0.0); }
};

/// How an illumination's cells of the seen face are explained.
struct SurfaceFit {
  std::string name;
  bool held_out = false;
  Image<float> predicted;              ///< L on the seen face, 3 channels
  ChannelErrors errors;                ///< over unmasked cells
  double chi_squared_per_datum = 0.0;  ///< as the reconstruction weighs data: InverseOptions

  /// Every cell is masked: the light could not be used.
  bool is_empty() const { return !(errors.all().signal > 0.0); }
};

/// Which pixels see the seen face well inside, not within `margin` pixels of its outline, where the
/// lens blurs it with what is beside it; and not cells that the mask leaves out.
Image<std::uint8_t> pixels_that_count(const Image<float>& rendered,
                                      const CameraModel& camera,
                                      const Block& block,
                                      Face seen_face,
                                      const Image<std::uint8_t>& cell_mask,
                                      int margin);

/// Relights one illumination: draws the field and compares with the picture taken.
Result<RelitLight> relight(render::Renderer& renderer,
                           const render::SurfaceField& field,
                           const CameraModel& camera,
                           const Dataset& dataset,
                           const Illumination& light,
                           const HdrPicture& captured,
                           std::stop_token stop);

/// Compares the field with the illumination's cells of the seen face. `model_error` is that of
/// reconstruct::InverseOptions.
SurfaceFit fit_on_surface(const Dataset& dataset,
                          const Illumination& light,
                          const render::SurfaceField& field,
                          double model_error);

}  // namespace opaline::daemon
