#pragma once

#include <stop_token>
#include <string>
#include <vector>

#include "base/result.h"
#include "reconstruct/tradeoff.h"

namespace opaline::daemon {

/// tradeoff.svg: seconds against relighting error, each dial in a colour of its own, with the front as a line and what
/// the noise alone makes across; below it, where the truth is known, seconds against the BSSRDF error E.
/// Errors: those of draw(); kInvalidArgument when no setting came to a figure.
Result<std::string> tradeoff_svg(const std::vector<reconstruct::TradeoffPoint>& points,
                                 std::stop_token stop);

}  // namespace opaline::daemon
