#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "daemon/report/plot.h"

namespace opaline::daemon {

/// What of reconstruction.json says how well each depth of the material is known, as HTML: what a deviation means, and a
/// table of them by depth, prior and unknown layers beside them; or why there are none.
///
/// A layer counts as unknown where its deviation is at least nine tenths of the prior's amplitude: nothing is known of its
/// cells but the level of the sample.
std::string uncertainty_section(const nlohmann::json& reconstruction);

/// (caption, plot) of log sigma_s' and log sigma_a: deviation against depth, one curve a channel, the prior's in grey and
/// its amplitude dashed. None where there are no deviations.
std::vector<std::pair<std::string, CurvePlot>> uncertainty_plots(
    const nlohmann::json& reconstruction);

}  // namespace opaline::daemon
