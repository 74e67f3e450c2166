#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <stop_token>

#include "base/dataset.h"
#include "base/material.h"
#include "base/result.h"
#include "base/transport_responses.h"
#include "reconstruct/inverse_options.h"
#include "reconstruct/tradeoff.h"

namespace opaline::daemon {

/// What a trade-off is measured on.
struct MeasuredDataset {
  Dataset dataset;
  reconstruct::InverseOptions options;      ///< the session's; the defaults for a dataset by itself
  std::optional<TransportResponses> truth;  ///< of a simulated sample on the same grid
};

/// From a session directory, or any directory with a dataset. Errors: kNotFound when it holds none; kInvalidArgument when
/// it cannot be used, or has no held-out lights to judge by.
Result<MeasuredDataset> read_measured_dataset(const std::filesystem::path& directory);

/// The solver that a setting asks for.
Result<reconstruct::TradeoffSolver> solver_of(const reconstruct::TradeoffSetting& setting);

/// The BSSRDF error E of a material against the truth; `data` outlives it. Empty where there is no truth.
std::function<Result<double>(const Material&, std::stop_token)> judge_of(
    const MeasuredDataset& data);

}  // namespace opaline::daemon
