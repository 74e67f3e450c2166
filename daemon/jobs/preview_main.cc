#include "daemon/jobs/job.h"
#include "daemon/report/session_report.h"

int main(int argc, char** argv) {
  return opaline::daemon::run_job(
      argc,
      argv,
      {"preview", "Relights a session's material under the held-out lights and writes the report."},
      [](opaline::daemon::JobContext& job) { return opaline::daemon::report_session(job); });
}
