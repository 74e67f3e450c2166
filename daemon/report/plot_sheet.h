#pragma once

#include <functional>
#include <stop_token>
#include <vector>

#include "base/result.h"
#include "daemon/report/report_data.h"

namespace opaline::daemon {

/// Draws every plot of the report, one after the other; `drawn` hears after each which share of them
/// is done. A plot that cannot be drawn carries the reason: a report with gaps is worth more than
/// none.
/// Errors: kCancelled.
Result<std::vector<DrawnPlot>> draw_plots(const ReportData& data,
                                          const std::function<void(double)>& drawn,
                                          std::stop_token stop);

}  // namespace opaline::daemon
