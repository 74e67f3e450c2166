#pragma once

#include <array>
#include <filesystem>

#include "base/material.h"
#include "base/result.h"
#include "reconstruct/inverse_options.h"

namespace opaline::daemon {

/// A homogeneous estimate to start an inverse diffusion from: medians of maps.exr (or of the session directory that holds one), or geometric means of a
/// material.vdb, told apart by their names. Errors: kNotFound; kInvalidArgument where some channel has no answer.
Result<std::array<reconstruct::StartCoefficients, kColorChannels>> read_start(
    const std::filesystem::path& path);

}  // namespace opaline::daemon
