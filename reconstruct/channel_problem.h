#pragma once

#include <optional>
#include <vector>

#include "base/dataset.h"
#include "base/ensure.h"
#include "reconstruct/diffusion/boundary.h"
#include "reconstruct/diffusion/camera_equation.h"
#include "reconstruct/diffusion/camera_rays.h"
#include "reconstruct/inverse_options.h"

namespace opaline::reconstruct {

/// One illumination in one colour channel. Shapes: rasters over the cells of the lit or the seen
/// face.
struct ChannelIllumination {
  std::vector<double> irradiance;  ///< q = (1 - R(0)) E on the lit face, transmitted, W/mm^2
  std::vector<double> radiance;    ///< L* on the seen face, W/(mm^2 sr)
  std::vector<double> weight;      ///< w of InverseOptions::model_error; 0 where masked
  double noise = 0.0;              ///< sum of w times the measured variance
};

/// One colour channel of a dataset, as the objective reads it.
struct ChannelProblem {
  Block block;
  Face lit_face = Face::kZMin;
  Face seen_face = Face::kZMax;
  diffusion::Boundary boundary;
  diffusion::SourceOptions source;
  std::vector<diffusion::CameraEquation> camera;  ///< per cell of the seen face
  std::vector<diffusion::CameraRay> rays;         ///< the same; empty with the surface's camera law
  std::vector<ChannelIllumination> illuminations;
  std::size_t data_count = 0;  ///< data of weight > 0
  double noise = 0.0;          ///< of all illuminations: the chi^2 that measured noise alone makes
  std::optional<StartCoefficients> start = std::nullopt;  ///< InverseOptions::start
};

/// Which illuminations of a dataset a problem takes.
enum class Selection : std::uint8_t { kFit, kHeldOut, kAll };

/// Errors: kInvalidArgument, naming the illumination, when shapes differ, values are not finite or
/// negative where that cannot be, a variance is missing, or nothing is left to fit.
Result<ChannelProblem> make_channel_problem(const Dataset& dataset,
                                            int channel,
                                            const InverseOptions& options,
                                            Selection selection);

}  // namespace opaline::reconstruct
