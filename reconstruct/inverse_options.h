#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include "base/dataset.h"
#include "base/result.h"
#include "reconstruct/diffusion/boundary.h"
#include "reconstruct/diffusion/precision.h"
#include "reconstruct/diffusion/source.h"

namespace opaline::reconstruct {

/// Which implementation of the diffusion solver computes.
enum class BackEnd : std::uint8_t {
  kAuto,       ///< a Vulkan device that is not a CPU, else host
  kHost,       ///< threads and SIMD
  kVulkan,     ///< compute shaders
  kReference,  ///< plain loops in double, for tests
};
std::string_view to_string(BackEnd back_end);  ///< "auto" | "host" | "vulkan" | "reference"

/// How the objective is minimised.
enum class Method : std::uint8_t {
  kLbfgs,        ///< limited-memory BFGS in (log sigma_s', log sigma_a) (reconstruct/lbfgs.h)
  kGaussNewton,  ///< inexact Gauss-Newton, conjugate gradients inside (reconstruct/gauss_newton.h)
  kAsPublished,  ///< Wang 2008, Table I (reconstruct/published_step.h), for comparison only
};
std::string_view to_string(Method method);  ///< "lbfgs" | "gauss_newton" | "as_published"

/// What the camera is taken to see of the fluence (docs/physics.md, "Radiance towards a camera").
enum class CameraLaw : std::uint8_t {
  kRefractedRay,  ///< what is scattered along the refracted ray (diffusion/camera_rays.h)
  kSurface,       ///< the P1 field under the surface (diffusion/camera_equation.h)
};
std::string_view to_string(CameraLaw law);  ///< "refracted_ray" | "surface"

/// How much of a sample may vary.
enum class Model : std::uint8_t {
  kAuto,  ///< what the held-out pictures ask for, from homogeneous on (reconstruct/model_choice.h)
  kHomogeneous,    ///< two numbers a channel
  kLayered,        ///< two numbers a layer and channel
  kHeterogeneous,  ///< two numbers a cell and channel
};
std::string_view to_string(Model model);  ///< "auto" | "homogeneous" | "layered" | "heterogeneous"

/// What the smoothness prior asks of the logarithms of the coefficients (reconstruct/regularizer.h).
enum class Smoothness : std::uint8_t {
  kH1,              ///< small squared gradients: blobs
  kTotalVariation,  ///< few edges, however sharp: veins, grains and layers
};
std::string_view to_string(Smoothness smoothness);  ///< "h1" | "tv"

/// Whether the colour channels of a heterogeneous sample have one structure or each its own.
enum class Structure : std::uint8_t {
  kSeparate,
  kShared,  ///< reconstruct/shared_structure.h; by L-BFGS
};
std::string_view to_string(Structure structure);  ///< "separate" | "shared"

/// Bounds of a coefficient, 1/mm; 0 < lowest < highest.
struct CoefficientBounds {
  double lowest = 0.0;
  double highest = 0.0;
};

/// A homogeneous material that is known beforehand, one channel, 1/mm; > 0.
struct StartCoefficients {
  double reduced_scattering = 1.0;
  double absorption = 0.01;
};

/// How a dataset is inverted.
struct InverseOptions {
  diffusion::SourceModel source = diffusion::SourceModel::kCollimated;
  bool choose_source =
      false;  ///< `source` is what choose_source() finds; who reconstructs calls it first
  diffusion::Deposit deposit = diffusion::Deposit::kCentroid;
  diffusion::BoundaryModel boundary = diffusion::BoundaryModel::kTwoMoment;
  CameraLaw camera = CameraLaw::kRefractedRay;  ///< without Dataset::view_direction kSurface
  /// Relative error of the diffusion model: (model_error hypot(L, l))^2 is added to the variance of each datum, l the
  /// root mean square of its picture, since the model's error far from the light does not fall with L; >= 0.
  double model_error = 0.01;
  /// Seen cells within so many transport mean free paths of directly lit ones are left out (reconstruct/direct_light.h);
  /// 0: only lit ones; >= 0.
  double direct_light_paths = 3.0;
  /// Weight of the smoothness prior, in chi-squared units: see reconstruct/regularizer.h; >= 0.
  double regularization = 300.0;
  Smoothness regularizer = Smoothness::kH1;
  Method method = Method::kLbfgs;
  Model model = Model::kAuto;  ///< Method::kAsPublished takes kAuto for kHeterogeneous
  Structure structure = Structure::kSeparate;  ///< not with Method::kAsPublished
  /// That a heterogeneous answer is found on first, each of half the cells an axis (reconstruct/coarse_start.h); >= 0.
  int coarser_grids = 2;
  /// The last fit is to pictures less what the grid leaves out (reconstruct/grid_correction.h), and predictions count it;
  /// where corrects_grid().
  bool grid_correction = false;
  int max_iterations = 150;  ///< per channel and model; 0 keeps the homogeneous fit
  double tolerance = 1e-5;   ///< of every diffusion solve, relative residual; > 0
  /// Discrepancy principle (Morozov 1966): stop once chi^2 <= sum w (var + discrepancy (model_error hypot(L, l))^2), the
  /// measured noise and this share of the model's error, which counts generously; 0 to 1.
  double discrepancy = 0.1;
  double stalled =
      0.01;  ///< stop when the objective falls by less than this fraction over ten iterations; >= 0
  CoefficientBounds absorption{1e-5, 10.0};
  CoefficientBounds reduced_scattering{0.02, 100.0};
  /// Where the homogeneous fit starts, in place of the best of a table (reconstruct/homogeneous_fit.h).
  std::optional<std::array<StartCoefficients, kColorChannels>> start = {};
  int checkpoint_every = 10;  ///< iterations; >= 1
  BackEnd back_end = BackEnd::kAuto;
  /// Whether host takes over when the device of back_end = "vulkan" is missing, full or lost; with "auto" it always does.
  bool back_end_fallback = false;
  int threads = 0;  ///< of the host back end; 0: one a core
  /// Of the host back end; vulkan has single only, and auto leaves it out where another one is asked for.
  diffusion::Precision precision = diffusion::Precision::kSingle;
};
Result<void> validate(const InverseOptions& options);  ///< "tolerance = 0; expected > 0"

/// Whether the camera is taken to see along refracted rays: where it is asked for, and the dataset knows their directions.
inline bool along_rays(const Dataset& dataset, const InverseOptions& options) {
  return options.camera == CameraLaw::kRefractedRay && !dataset.view_direction.samples().empty();
}

}  // namespace opaline::reconstruct
