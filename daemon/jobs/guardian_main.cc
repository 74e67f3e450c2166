#include <cstdio>
#include <string_view>

#include "base/log.h"
#include "base/session_directory.h"
#include "config/session_config.h"
#include "daemon/jobs/guardian.h"
#include "daemon/jobs/program.h"
#include "daemon/light_switch.h"

// opaline-guardian SESSION_DIR: started by opaline-capture, never by hand. Makes the session's light source dark when
// its standard input ends, which it does when the capture does.

namespace {

int program(int argc, char** argv) {
  if (argc != 2 || std::string_view(argv[1]).starts_with('-')) {
    std::fputs("Usage: opaline-guardian SESSION_DIR (opaline-capture starts it)\n", stderr);
    return 2;
  }
  const auto session = opaline::SessionDirectory::open(argv[1]);
  if (!session) {
    opaline::log::error("opaline-guardian: {}", session.error().message);
    return 2;
  }
  const auto config = opaline::config::load_resolved(*session);
  if (!config) {
    opaline::log::error("opaline-guardian: {}", config.error().message);
    return 2;
  }
  return opaline::daemon::guard(opaline::daemon::guardian_lock_path(config->rig.station),
                                opaline::daemon::light_switch(config->rig));
}

}  // namespace

int main(int argc, char** argv) { return opaline::daemon::run_program(argc, argv, program); }
