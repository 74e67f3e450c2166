#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>

#include "base/files.h"
#include "base/log.h"
#include "config/session_config.h"
#include "daemon/jobs/program.h"
#include "daemon/jobs/stop_signals.h"
#include "daemon/jobs/version.h"
#include "daemon/simulated_rig.h"
#include "sim/rig_client.h"
#include "sim/rig_codec.h"
#include "sim/rig_server.h"

// opaline-rig: the simulated station as a process of its own, which outlives, as hardware does, whoever drives it.

namespace {

using opaline::Result;
namespace sim = opaline::sim;

constexpr const char* kExamples = R"(
Examples:
  opaline-rig serve --config config/sim-rig.toml --socket /tmp/rig.sock
  opaline-rig status /tmp/rig.sock              lamp, pattern, exposures, faults to come, as JSON
  opaline-rig truth /tmp/rig.sock               irradiance and radiance behind the pattern being shown
  opaline-rig fault /tmp/rig.sock torn_frame --skip 3 --count 2
  opaline-rig dark /tmp/rig.sock
  opaline-rig stop /tmp/rig.sock)";

struct Arguments {
  std::string config;
  std::string session;
  std::string socket;
  double idle_minutes = 15.0;
  std::string fault;
  sim::Fault details;
  bool clear = false;
};

/// Progress of a long start as lines in the log, one for every tenth of a step.
class LogProgress : public opaline::EventSink {
 public:
  void progress(const opaline::Progress& progress) override {
    const int tenth = static_cast<int>(progress.fraction * 10.0);
    const std::lock_guard lock(mutex_);
    if (progress.step == step_ && tenth <= tenth_) return;
    step_ = progress.step;
    tenth_ = tenth;
    opaline::log::info("{}: {} %", step_, 10 * tenth);
  }
  Result<void> fact(std::string_view /*type*/, const nlohmann::json& /*data*/) override {
    return opaline::ok();
  }

 private:
  std::mutex mutex_;
  std::string step_;
  int tenth_ = -1;
};

Result<opaline::config::RigConfig> read_config(const Arguments& arguments) {
  if (arguments.session.empty()) return opaline::config::load_rig(arguments.config);
  const auto directory = opaline::SessionDirectory::open(arguments.session);
  if (!directory) return directory.error();
  const auto session = opaline::config::load_resolved(*directory);
  if (!session) return session.error();
  return session->rig;
}

Result<void> serve(const Arguments& arguments) {
  std::stop_source stop;
  const auto signals = opaline::daemon::StopSignals::watch([&](int) { stop.request_stop(); });
  if (!signals) return signals.error();
  const auto config = read_config(arguments);
  if (!config) return config.error();
  const std::filesystem::path socket = arguments.socket.empty()
                                           ? opaline::config::rig_socket(*config)
                                           : std::filesystem::path(arguments.socket);
  if (socket.has_parent_path()) {
    if (auto made = opaline::system_files().make_directories(socket.parent_path()); !made)
      return made;
  }
  LogProgress progress;
  const auto rig = opaline::daemon::build_rig(config->sim, progress, stop.get_token());
  if (!rig) return rig.error();
  const auto server = sim::RigServer::create(**rig, socket);
  if (!server) return server.error();
  opaline::log::info("simulated rig {}: serves at {}, time factor {}",
                     config->station,
                     socket.string(),
                     config->sim.rig.time_factor);
  fmt::print("ready {}\n", socket.string());
  std::fflush(stdout);
  const auto idle = std::chrono::duration_cast<std::chrono::nanoseconds>(
      std::chrono::duration<double, std::ratio<60>>(arguments.idle_minutes));
  auto served = (*server)->serve(idle, stop.get_token());
  opaline::log::info("simulated rig {}: ends", config->station);
  return served;
}

Result<void> print_status(const Arguments& arguments) {
  const auto status = sim::RigClient(arguments.socket).status();
  if (!status) return status.error();
  fmt::print("{}\n", sim::encode(*status).header.dump(2));
  return opaline::ok();
}

Result<void> print_truth(const Arguments& arguments) {
  const auto truth = sim::RigClient(arguments.socket).truth();
  if (!truth) return truth.error();
  nlohmann::json json = sim::encode(*truth).header;
  json["patch_irradiance"] = truth->patch_irradiance;
  json["surface_radiance"] = truth->surface_radiance.samples();
  fmt::print("{}\n", json.dump());
  return opaline::ok();
}

Result<void> add_fault(const Arguments& arguments) {
  sim::RigClient client(arguments.socket);
  sim::Faults faults;
  if (!arguments.fault.empty()) {
    const auto kind = sim::fault_from_name(arguments.fault);
    if (!kind) return kind.error();
    sim::Fault fault = arguments.details;
    fault.kind = *kind;
    faults.push_back(fault);
  }
  return arguments.clear ? client.arm(faults) : client.add(faults);
}

std::string fault_list() {
  std::string text = "\nFaults:\n";
  for (const sim::FaultName& fault : sim::fault_names()) {
    text += fmt::format("  {:<16} {}\n", fault.name, fault.meaning);
  }
  return text;
}

void add_serve(CLI::App& app, Arguments& a) {
  CLI::App* serve = app.add_subcommand("serve", "be the station, until told to stop");
  auto* config = serve->add_option("--config", a.config, "rig file");
  serve->add_option("--session", a.session, "session directory whose rig it is")->excludes(config);
  serve->add_option("--socket", a.socket, "where to serve; by default where the rig file says");
  serve->add_option("--idle-minutes", a.idle_minutes, "ends when dark and not asked for so long")
      ->capture_default_str()
      ->check(CLI::PositiveNumber);
}

void add_clients(CLI::App& app, Arguments& a) {
  for (const auto& [name, help] :
       {std::pair{"status", "what the station is doing, as JSON"},
        std::pair{"truth", "the light behind the pattern being shown, as JSON"},
        std::pair{"dark", "switch the lamp off"},
        std::pair{"fault", "make something go wrong"},
        std::pair{"stop", "darken the lamp and end"}}) {
    app.add_subcommand(name, help)->add_option("socket", a.socket, "of the station")->required();
  }
  CLI::App* fault = app.get_subcommand("fault");
  fault->add_option("name", a.fault, "which; see below");
  fault->add_option("--pattern", a.details.pattern, "only with this pattern; 0 = any");
  fault->add_option("--skip", a.details.skip, "events that pass first")
      ->check(CLI::NonNegativeNumber);
  fault->add_option("--count", a.details.count, "events that fail")->check(CLI::PositiveNumber);
  fault->add_flag("--clear", a.clear, "forget the faults still to come first");
  fault->footer(fault_list());
}

Result<void> run(const CLI::App& app, const Arguments& arguments) {
  const std::string command = app.get_subcommands().front()->get_name();
  if (command == "serve") return serve(arguments);
  if (command == "status") return print_status(arguments);
  if (command == "truth") return print_truth(arguments);
  if (command == "dark") return sim::RigClient(arguments.socket).dark(sim::RigPort::kAnybody);
  if (command == "fault") return add_fault(arguments);
  return sim::RigClient(arguments.socket).end();
}

int program(int argc, char** argv) {
  CLI::App app("The simulated station as a process of its own.");
  Arguments arguments;
  add_serve(app, arguments);
  add_clients(app, arguments);
  app.require_subcommand(1);
  app.set_version_flag("--version", std::string(opaline::daemon::version()));
  app.footer(kExamples);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  const CLI::App* serve = app.get_subcommand("serve");
  if (serve->parsed() && arguments.config.empty() && arguments.session.empty()) {
    opaline::log::error("serve: expected --config FILE or --session DIRECTORY");
    return 2;
  }
  const auto done = run(app, arguments);
  if (done) return 0;
  opaline::log::error("{}", done.error().message);
  return opaline::daemon::status_of(done);
}

}  // namespace

int main(int argc, char** argv) { return opaline::daemon::run_program(argc, argv, program); }
