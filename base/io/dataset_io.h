#pragma once

#include <filesystem>

#include "base/dataset.h"
#include "base/files.h"
#include "base/result.h"

namespace opaline {

inline constexpr int kDatasetFormat = 3;  ///< 1: without view_direction; 2: without a uniform light

/// A dataset on disk, in `directory`:
///
///   dataset.exr        the seen face: view_cosine, view_direction.column and .row; per illumination
///                      NAME.radiance.R G B, NAME.variance.R G B and NAME.mask (0 or 1)
///   dataset_light.exr  the lit face: per illumination NAME.irradiance.R G B
///   dataset.json       format version, block, ior, faces, the illuminations in order, the uniform
///                      one last and marked as such, SHA-256 of both
///
/// dataset.json is written last and each file whole, so what can be read is complete. The same
/// dataset gives the same bytes.
/// Errors: kInvalidArgument for shapes that do not fit the block or names given twice;
/// kUnavailable.
Result<void> write_dataset(FileOperations& files,
                           const std::filesystem::path& directory,
                           const Dataset& dataset);

/// Reads back exactly what was written.
/// Errors: kNotFound when there is none; kInvalidArgument when a newer version wrote it, or when a
/// file is damaged, naming it.
Result<Dataset> read_dataset(const std::filesystem::path& directory);

}  // namespace opaline
