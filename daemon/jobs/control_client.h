#pragma once

#include <chrono>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "base/result.h"

namespace opaline::daemon {

/// Sends one request to a running job's control.sock and returns its answer, when it says "ok".
/// Errors: kUnavailable when no job listens, kTimeout, or what the job answered.
Result<nlohmann::json> ask_job(const std::filesystem::path& socket,
                               const nlohmann::json& request,
                               std::chrono::milliseconds deadline = std::chrono::seconds(2));

}  // namespace opaline::daemon
