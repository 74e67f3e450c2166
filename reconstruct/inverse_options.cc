#include "reconstruct/inverse_options.h"

#include <fmt/format.h>
#include <array>

#include <cmath>

namespace opaline::reconstruct {
namespace {

Error expected(std::string_view name, double value, std::string_view range) {
  return invalid_argument(fmt::format("{} = {}; expected {}", name, value, range));
}

Result<void> validate_bounds(std::string_view name, const CoefficientBounds& bounds) {
  if (bounds.lowest > 0.0 && bounds.highest > bounds.lowest && std::isfinite(bounds.highest)) {
    return ok();
  }
  return invalid_argument(fmt::format(
      "{} bounds = [{}, {}]; expected 0 < lowest < highest", name, bounds.lowest, bounds.highest));
}

bool not_negative(double value) { return value >= 0.0 && std::isfinite(value); }

}  // namespace

std::string_view to_string(BackEnd back_end) {
  switch (back_end) {
    case BackEnd::kAuto:
      return "auto";
    case BackEnd::kHost:
      return "host";
    case BackEnd::kVulkan:
      return "vulkan";
    case BackEnd::kReference:
      return "reference";
  }
  return "auto";
}

std::string_view to_string(Method method) {
  switch (method) {
    case Method::kLbfgs:
      return "lbfgs";
    case Method::kGaussNewton:
      return "gauss_newton";
    case Method::kAsPublished:
      return "as_published";
  }
  return "lbfgs";
}

std::string_view to_string(CameraLaw law) {
  return law == CameraLaw::kRefractedRay ? "refracted_ray" : "surface";
}

std::string_view to_string(Model model) {
  constexpr std::array<std::string_view, 4> names{
      "auto", "homogeneous", "layered", "heterogeneous"};
  return names.at(static_cast<std::size_t>(model));
}

std::string_view to_string(Smoothness smoothness) {
  return smoothness == Smoothness::kH1 ? "h1" : "tv";
}

std::string_view to_string(Structure structure) {
  return structure == Structure::kSeparate ? "separate" : "shared";
}

Result<void> validate(const InverseOptions& o) {
  if (o.structure == Structure::kShared && o.method == Method::kAsPublished)
    return invalid_argument(
        "structure = shared with method = as_published; expected another method, or separate");
  if (o.start)
    for (const StartCoefficients& s : *o.start)
      if (!(s.reduced_scattering > 0.0 && s.absorption > 0.0))
        return expected(
            "start", std::min(s.reduced_scattering, s.absorption), "> 0 in every channel");
  if (!not_negative(o.direct_light_paths))
    return expected("direct_light_paths", o.direct_light_paths, ">= 0");
  if (!not_negative(o.model_error)) return expected("model_error", o.model_error, ">= 0");
  if (!not_negative(o.regularization)) return expected("regularization", o.regularization, ">= 0");
  if (o.coarser_grids < 0) return expected("coarser_grids", o.coarser_grids, ">= 0");
  if (o.max_iterations < 0) return expected("max_iterations", o.max_iterations, ">= 0");
  if (!(o.tolerance > 0.0 && o.tolerance < 1.0))
    return expected("tolerance", o.tolerance, "> 0 and < 1");
  if (!(o.discrepancy >= 0.0 && o.discrepancy <= 1.0))
    return expected("discrepancy", o.discrepancy, "0 to 1");
  if (!not_negative(o.stalled)) return expected("stalled", o.stalled, ">= 0");
  if (o.checkpoint_every < 1) return expected("checkpoint_every", o.checkpoint_every, ">= 1");
  if (o.threads < 0) return expected("threads", o.threads, ">= 0");
  if (o.precision != diffusion::Precision::kSingle && o.back_end == BackEnd::kVulkan)
    return invalid_argument(
        fmt::format("precision = \"{}\" with back_end = \"vulkan\", which computes in single; "
                    "expected back_end = \"host\"",
                    to_string(o.precision)));
  if (auto valid = validate_bounds("absorption", o.absorption); !valid) return valid;
  return validate_bounds("reduced_scattering", o.reduced_scattering);
}

}  // namespace opaline::reconstruct
