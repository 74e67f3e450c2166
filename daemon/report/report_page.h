#pragma once

#include <stop_token>
#include <string>

#include "base/result.h"
#include "daemon/report/report_data.h"

namespace opaline::daemon {

/// report.html: one file with everything inside, for a browser with or without JavaScript, on
/// paper, in the dark.
/// Errors: those of the plots (plot.h); kInvalidArgument when there is no light to show.
Result<std::string> report_page(const ReportData& data, std::stop_token stop);

}  // namespace opaline::daemon
