#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "base/files.h"
#include "base/material.h"
#include "base/result.h"
#include "base/uncertainty.h"

namespace opaline {

/// A material as an OpenVDB file, which Blender, Houdini and every VDB tool open.
///
///   grids      absorption, reduced_scattering (1/mm) and diffusion (mm), each a vec3s grid holding
///              (red, green, blue): volume shaders take a colour from one vector grid, where three
///              float grids would have to be combined by hand
///              absorption_log_sd, reduced_scattering_log_sd, diffusion_log_sd (1), likewise, where
///              the uncertainty was computed: standard deviations of the natural logarithms, so 0.1
///              is about 10 % and 1 a factor of e (base/uncertainty.h); and absorption_log_shift,
///              reduced_scattering_log_shift, diffusion_log_shift: from these logarithms to the
///              posterior's mean; all six or none
///   transform  index (i, j, k) is the centre of cell (i, j, k): world = ((i + 0.5) hx,
///              (j + 0.5) hy, (k + 0.5) hz), in mm; cells need not be cubes
///   metadata   file: opaline_format (int32), opaline_generator, opaline_name, opaline_ior,
///              opaline_cells; grid: opaline_unit, opaline_channels, class "fog volume"
///   values     float32, every cell active; diffusion = 1 / (3 (absorption + reduced_scattering))
///              is for other programs, and not read back
///
/// This library is the only user of OpenVDB.
/// Threads: safe on different files.
/// Errors:  kInvalidArgument for a file that is truncated, damaged, no VDB, not ours, or written by
///          a newer version, and for a material whose fields do not fit its block; kNotFound;
///          kUnavailable when the disk is full.
inline constexpr int kMaterialFormat = 1;

/// `generator` says what made the material: "opaline-reconstruct 0.1.0".
Result<void> write_material(FileOperations& files,
                            const std::filesystem::path& path,
                            const Material& material,
                            std::string_view generator,
                            const MaterialUncertainty* uncertainty = nullptr);
Result<Material> read_material(const std::filesystem::path& path);

/// The same in memory.
Result<std::string> encode_material(const Material& material,
                                    std::string_view generator,
                                    const MaterialUncertainty* uncertainty = nullptr);
Result<Material> decode_material(std::string_view bytes);

/// How well the material of such a file is known; nothing where that was not computed.
Result<std::optional<MaterialUncertainty>> read_uncertainty(const std::filesystem::path& path);

}  // namespace opaline
