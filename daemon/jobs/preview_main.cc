// opaline-preview: the last stage of a session, and an object of its material shown while it is edited.

#include <CLI/CLI.hpp>
#include <chrono>
#include <string_view>

#include "config/session_config.h"
#include "daemon/jobs/command_program.h"
#include "daemon/jobs/job.h"
#include "daemon/jobs/program.h"
#include "daemon/jobs/stop_signals.h"
#include "daemon/preview/live_object.h"
#include "daemon/report/session_report.h"
#include "daemon/scattering/sphere_report.h"

namespace opaline::daemon {
namespace {

Result<void> preview(JobContext& job) {
  const auto config = config::load_resolved(job.session);
  if (!config) return config.error();
  return config->kind == config::SessionKind::kLedSphere ? report_sphere(job) : report_session(job);
}

Result<void> show(const std::filesystem::path& directory, const LiveObjectOptions& options) {
  const auto session = SessionDirectory::open(directory);
  if (!session) return session.error();
  std::stop_source stop;
  const auto signals = StopSignals::watch([&](int) { stop.request_stop(); });
  if (!signals) return signals.error();
  return show_object(*session, options, stop.get_token());
}

int live(int argc, char** argv) {
  CLI::App app("Shows an object of a session's material while it is edited (docs/rendering.md).");
  std::filesystem::path directory;
  LiveObjectOptions options;
  int watched = 0;
  bool is_live = false;
  app.add_flag("--live", is_live, "This, in place of the session's preview");
  app.add_option("SESSION_DIR", directory)->required();
  app.add_option(
         "--while-watched",
         watched,
         "End once nobody has looked at it over HTTP for so many seconds; 0: Ctrl-C ends it")
      ->check(CLI::NonNegativeNumber);
  app.add_option("--threads", options.threads, "0: one a processor")->check(CLI::Range(0, 1024));
  app.footer(
      "Pictures and figures are in SESSION_DIR/preview/live, which also has the socket.\n"
      "Exit status: 0 done, 1 failed, 2 bad scene, 4 another shows it");
  return run_command(app, "opaline-preview", argc, argv, [&] {
    options.while_watched = std::chrono::seconds(watched);
    return show(directory, options);
  });
}

int program(int argc, char** argv) {
  if (argc > 1 && std::string_view(argv[1]) == "--live") return live(argc, argv);
  return run_job(
      argc,
      argv,
      {"preview",
       "Relights a session's material under the held-out lights and writes the report.\n"
       "With --live first: shows an object of the material while it is edited (--live --help)."},
      preview);
}

}  // namespace
}  // namespace opaline::daemon

int main(int argc, char** argv) {
  return opaline::daemon::run_program(argc, argv, opaline::daemon::program);
}
