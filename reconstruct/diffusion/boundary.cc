#include "reconstruct/diffusion/boundary.h"

#include <fmt/format.h>

#include <cmath>

#include "base/ensure.h"
#include "reconstruct/diffusion/fresnel.h"

namespace opaline::reconstruct::diffusion {
namespace {

constexpr double kHopf = 0.7104460895987627;  // extrapolation length of Milne's problem

// A = (2 / (1 - R0) - 1 + |cos c|^3) / (1 - |cos c|^2), c the critical angle (Schweiger et al.
// 1995, Eq. 8).
double keijzer_a(double ior) {
  const double critical = std::sqrt(1.0 - 1.0 / (ior * ior));
  return (2.0 / (1.0 - normal_reflectance(ior)) - 1.0 + critical * critical * critical) /
         (1.0 - critical * critical);
}

double boundary_a(BoundaryModel model, double ior, const FresnelMoments& moments) {
  switch (model) {
    case BoundaryModel::kTwoMoment:
      return (1.0 + moments.flux) / (1.0 - moments.fluence);
    case BoundaryModel::kJensen:
      return (1.0 + moments.fluence) / (1.0 - moments.fluence);
    case BoundaryModel::kKeijzer:
      return keijzer_a(ior);
    case BoundaryModel::kMilne:
      return (1.0 + moments.flux) / (1.0 - moments.fluence) + 1.5 * kHopf - 1.0;
  }
  ENSURE(false);
  return 1.0;
}

}  // namespace

std::string_view to_string(BoundaryModel model) {
  switch (model) {
    case BoundaryModel::kTwoMoment:
      return "two_moment";
    case BoundaryModel::kJensen:
      return "jensen";
    case BoundaryModel::kKeijzer:
      return "keijzer";
    case BoundaryModel::kMilne:
      return "milne";
  }
  return "two_moment";
}

Result<Boundary> make_boundary(BoundaryModel model, double ior) {
  if (!(ior >= 1.0 && ior <= 3.0)) {
    return invalid_argument(fmt::format("refractive index {}; expected 1 to 3", ior));
  }
  const FresnelMoments moments = internal_moments(ior);
  return Boundary{boundary_a(model, ior, moments), 4.0 / (1.0 - moments.fluence)};
}

}  // namespace opaline::reconstruct::diffusion
