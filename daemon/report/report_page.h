#pragma once

#include <string>

#include "base/result.h"
#include "daemon/report/report_data.h"

namespace opaline::daemon {

/// report.html: one file with everything inside, for a browser with or without JavaScript, on
/// paper, in the dark.
/// Errors: kInternal when a picture cannot be encoded.
Result<std::string> report_page(const ReportData& data);

}  // namespace opaline::daemon
