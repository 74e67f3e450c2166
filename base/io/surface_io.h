#pragma once

#include <filesystem>

#include "base/files.h"
#include "base/result.h"
#include "base/surface_reflectance.h"

namespace opaline {

inline constexpr int kSurfaceFormat = 1;

/// A surface's reflectance as an EXR beside the material:
///
///   channels   R G B (rho_s, 1/sr), variance.R G B, mask (0 or 1); row 0 is the raster's first row (base/block.h)
///   metadata   opaline_format, opaline_face ("z_max"), opaline_cells ("48 48 24"), opaline_spacing_mm ("0.5 0.5 0.5")
///
/// Errors: kInvalidArgument for rasters that do not fit, a damaged or foreign file, a newer format; kNotFound;
/// kUnavailable.
Result<void> write_surface(FileOperations& files,
                           const std::filesystem::path& path,
                           const SurfaceReflectance& surface);
Result<SurfaceReflectance> read_surface(const std::filesystem::path& path);

}  // namespace opaline
