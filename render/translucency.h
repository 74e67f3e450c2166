#pragma once

#include <optional>
#include <span>
#include <stop_token>
#include <vector>

#include "base/block.h"
#include "base/image.h"
#include "base/material.h"
#include "base/pose.h"
#include "base/result.h"
#include "reconstruct/diffusion/boundary.h"
#include "reconstruct/diffusion/fluence_solver.h"
#include "reconstruct/diffusion/source.h"
#include "render/surface_field.h"

namespace opaline::render {

/// Light on one face of a block, perpendicular to it.
struct Light {
  Face lit_face = Face::kZMin;
  Image<float> irradiance;  ///< E before Fresnel, on the cells of the lit face, 3 channels, W/mm^2
};

struct TranslucencyOptions {
  reconstruct::diffusion::BoundaryModel boundary =
      reconstruct::diffusion::BoundaryModel::kTwoMoment;
  reconstruct::diffusion::SourceOptions source;
  reconstruct::diffusion::SolveOptions solve;
  /// Where the pictures will be taken from, mm. Faces turned to it then shine towards it as the fluence along refracted
  /// rays makes them (reconstruct/diffusion/camera_rays.h; on a lit face with diffusion/lit_surface.h): J_n and phi_s = S + 2 A J_n are those of the P1 field of that
  /// radiance. From elsewhere, and without an eye, they are the P1 field's own.
  std::optional<Vec3> eye;
};

/// Light off a surface of reflectance rho_s (1/sr) under irradiance E, face cells, 3 channels: FaceField::reflected.
Image<float> reflected(const Image<float>& reflectance, const Image<float>& irradiance);

/// How a block of the material glows under each light: the diffusion equation, solved channel by channel for all lights
/// at once, and from its fluence phi on the surface (docs/physics.md, "Boundary" and "Discretisation on a block sample")
///
///   J_n = g_b (phi - S) + X,   phi_s = S + 2 A J_n       (S and X only on the lit face: diffusion/source.h)
///
/// Answers one field for each light, in their order.
/// Errors: kInvalidArgument when shapes or coefficients make no sense; kCancelled; kUnavailable when the solver's device
///         is lost; kInternal when the solver stops far from the solution.
Result<std::vector<SurfaceField>> illuminate(const Material& material,
                                             std::span<const Light> lights,
                                             const TranslucencyOptions& options,
                                             reconstruct::diffusion::FluenceSolver& solver,
                                             std::stop_token stop);

}  // namespace opaline::render
