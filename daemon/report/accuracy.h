#pragma once

#include <string>

#include "daemon/report/report_data.h"

namespace opaline::daemon {

/// The report's section on speed against accuracy: the quality that was asked for, and where the session asked for a
/// relighting error, what was tried to reach it and how that ended.
std::string accuracy_section(const ReportData& data);

}  // namespace opaline::daemon
