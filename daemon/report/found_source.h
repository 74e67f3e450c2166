#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>

#include "reconstruct/diffusion/source.h"

namespace opaline::daemon {

/// The source that a reconstruction took, by the options in its reconstruction.json; nothing where it does not tell. The session's
/// own setting may have left it to the pictures.
std::optional<reconstruct::diffusion::SourceModel> found_source(
    const nlohmann::json& reconstruction);

}  // namespace opaline::daemon
