// opalined: serves sessions over HTTP and a Unix socket, and takes them through their stages.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <string>

#include "base/files.h"
#include "base/log.h"
#include "daemon/executor.h"
#include "daemon/http_server.h"
#include "daemon/jobs/program.h"
#include "daemon/jobs/version.h"
#include "daemon/routes/artefacts.h"
#include "daemon/routes/events.h"
#include "daemon/routes/objects.h"
#include "daemon/routes/sessions.h"
#include "daemon/routes/status.h"
#include "daemon/routes/viewfinders.h"
#include "daemon/runtime_paths.h"
#include "daemon/session_rules.h"
#include "daemon/station.h"
#include "daemon/token_file.h"

namespace {

using namespace opaline;          // NOLINT(google-build-using-namespace)
using namespace opaline::daemon;  // NOLINT(google-build-using-namespace)

struct Arguments {
  Station::Options station{default_sessions(), program_directory()};
  HttpServer::Options http;
  std::filesystem::path token_file;
};

void declare(CLI::App& app, Arguments& arguments) {
  app.description(
      "Takes capture sessions from a configuration to a report, and serves them over HTTP and a "
      "Unix socket. Stopped or killed, it leaves running jobs alone; started again, it goes on "
      "with them.");
  app.add_option("--sessions", arguments.station.root, "Directory of the session directories")
      ->capture_default_str();
  app.add_option("--listen", arguments.http.address, "IP address for HTTP; empty for none")
      ->capture_default_str();
  app.add_option("--port", arguments.http.port, "Port for HTTP; 0 takes a free one, and says which")
      ->capture_default_str();
  app.add_option(
      "--socket",
      arguments.http.socket,
      "Unix socket; default $OPALINE_SOCKET or opaline/opalined.sock in the runtime directory");
  app.add_option("--token-file",
                 arguments.token_file,
                 "File with the token that every request over HTTP must bring, for this user's "
                 "eyes only; without one only loopback addresses are served")
      ->check(CLI::ExistingFile);
  app.add_option(
         "--programs", arguments.station.programs, "Directory of opaline-capture and its siblings")
      ->capture_default_str();
  app.set_version_flag("--version", std::string("opalined ") + std::string(version()));
  app.footer(
      "Examples:\n  opalined --sessions ~/sessions\n  opalined --listen 0.0.0.0 --token-file "
      "/etc/opaline/token\n  curl --unix-socket $XDG_RUNTIME_DIR/opaline/opalined.sock "
      "http://localhost/v1/status");
}

void announce(const HttpServer& server, const Arguments& arguments) {
  if (server.port() != 0) {
    fmt::print("http://{}:{}\n", arguments.http.address, server.port());
    std::fflush(stdout);
  }
  log::info("opalined {}: sessions in {}, HTTP {}:{}, socket {}",
            version(),
            arguments.station.root.string(),
            arguments.http.address,
            server.port(),
            arguments.http.socket.string());
}

Result<void> serve(Arguments& arguments) {
  if (arguments.http.socket.empty()) {
    const Result<std::filesystem::path> socket = default_socket();
    if (!socket) return socket.error();
    arguments.http.socket = *socket;
  }
  if (!arguments.token_file.empty()) {
    const Result<std::string> token = read_token(arguments.token_file);
    if (!token) return token.error();
    arguments.http.token = *token;
  }
  arguments.station.root = std::filesystem::absolute(arguments.station.root);
  const auto station = Station::create(arguments.station, {contents_of, station_lock_of});
  if (!station) return station.error();
  Router router;
  add_session_routes(router, **station);
  add_event_routes(router, **station);
  add_artefact_routes(router, **station);
  add_status_routes(router, **station);
  const auto live = live_root();
  if (!live) return live.error();
  LocalExecutor executor(arguments.station.programs);
  Viewfinders viewfinders(
      {*live,
       station_of,
       [&](const std::filesystem::path& lock) { return (*station)->user_of(lock); }},
      executor,
      system_files());
  add_viewfinder_routes(router, viewfinders);
  LiveObjects objects(
      [&](const std::string& id) { return (*station)->directory(id); }, executor, system_files());
  add_object_routes(router, objects);
  const auto server = HttpServer::listen(
      arguments.http, [&](const HttpRequest& request) { return router.handle(request); });
  if (!server) return server.error();
  announce(**server, arguments);
  (*server)->run();
  log::info("opalined: stopped; running jobs go on");
  return ok();
}

int program(int argc, char** argv) {
  CLI::App app;
  Arguments arguments;
  declare(app, arguments);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : 2;
  }
  const Result<void> served = serve(arguments);
  if (served) return 0;
  log::critical("opalined: {}", served.error().message);
  return status_of(served);
}

}  // namespace

int main(int argc, char** argv) { return opaline::daemon::run_program(argc, argv, program); }
