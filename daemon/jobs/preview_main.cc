#include "config/session_config.h"
#include "daemon/jobs/job.h"
#include "daemon/report/session_report.h"
#include "daemon/scattering/sphere_report.h"

int main(int argc, char** argv) {
  return opaline::daemon::run_job(
      argc,
      argv,
      {"preview", "Relights a session's material under the held-out lights and writes the report."},
      [](opaline::daemon::JobContext& job) -> opaline::Result<void> {
        const auto config = opaline::config::load_resolved(job.session);
        if (!config) return config.error();
        return config->kind == opaline::config::SessionKind::kLedSphere
                   ? opaline::daemon::report_sphere(job)
                   : opaline::daemon::report_session(job);
      });
}
