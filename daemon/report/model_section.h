#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "daemon/report/plot.h"

namespace opaline::daemon {

/// What of reconstruction.json says how much model the sample needed, as HTML: the answer and the reason a channel; the two
/// numbers of homogeneous channels with their 95 % intervals; the models tried, with held-out errors. Empty where the
/// reconstruction does not tell.
std::string model_section(const nlohmann::json& reconstruction);

/// Held-out chi^2 per datum against the model, one curve a channel, and the 1 that noise and the model's error make;
/// nothing where fewer than two models were tried or nothing was held out.
std::optional<CurvePlot> ladder_plot(const nlohmann::json& reconstruction);

}  // namespace opaline::daemon
