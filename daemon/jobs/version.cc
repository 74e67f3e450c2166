#include "daemon/jobs/version.h"

namespace opaline::daemon {

std::string_view version() { return OPALINE_VERSION; }

}  // namespace opaline::daemon
