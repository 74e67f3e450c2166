#include "daemon/simulated_rig.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <unistd.h>

extern "C" {  // glibc 2.36 forgets to say so itself
#include <sys/pidfd.h>
}

#include <algorithm>
#include <span>
#include <system_error>
#include <utility>

#include "base/file_descriptor.h"
#include "base/files.h"
#include "base/io/transport_io.h"
#include "base/lock.h"
#include "base/log.h"
#include "base/sha256.h"
#include "config/session_config.h"
#include "daemon/jobs/version.h"
#include "sim/board_optics.h"
#include "sim/color_chart.h"
#include "sim/holder_optics.h"
#include "sim/led_blob.h"
#include "sim/rig_client.h"
#include "sim/rig_message.h"
#include "sim/transport_store.h"

namespace opaline::daemon {
namespace {

using namespace std::chrono_literals;
using sim::Deadline;

/// posix_spawn's two bags of settings, which want destroying.
struct SpawnSettings {
  SpawnSettings() {
    ::posix_spawn_file_actions_init(&actions);
    ::posix_spawnattr_init(&attributes);
  }
  ~SpawnSettings() {
    ::posix_spawn_file_actions_destroy(&actions);
    ::posix_spawnattr_destroy(&attributes);
  }
  SpawnSettings(const SpawnSettings&) = delete;
  SpawnSettings& operator=(const SpawnSettings&) = delete;

  posix_spawn_file_actions_t actions{};
  posix_spawnattr_t attributes{};
};

std::filesystem::path log_of(const RigProcess& process) {
  std::filesystem::path log = process.socket;
  log += ".log";
  return log;
}

Result<pid_t> spawn(const RigProcess& process) {
  std::vector<std::string> words{process.program.string()};
  words.insert(words.end(), process.arguments.begin(), process.arguments.end());
  words.insert(words.end(), {"--socket", process.socket.string()});
  std::vector<char*> argv;
  argv.reserve(words.size() + 1);
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);

  const std::string log = log_of(process).string();
  SpawnSettings settings;
  ::posix_spawn_file_actions_addopen(&settings.actions, 0, "/dev/null", O_RDONLY, 0);
  ::posix_spawn_file_actions_addopen(
      &settings.actions, 1, log.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0600);
  ::posix_spawn_file_actions_adddup2(&settings.actions, 1, 2);
  ::posix_spawn_file_actions_addclosefrom_np(&settings.actions, 3);
  ::posix_spawnattr_setflags(&settings.attributes, POSIX_SPAWN_SETSID);
  pid_t pid = 0;
  const int failed =
      ::posix_spawn(&pid, argv[0], &settings.actions, &settings.attributes, argv.data(), environ);
  if (failed == 0) return pid;
  return unavailable(
      fmt::format("cannot start {}: {}", argv[0], std::generic_category().message(failed)));
}

/// Whether a rig of the right identity answers. One of another identity is asked to end.
bool answers(const RigProcess& process) {
  sim::RigClient client(process.socket);
  const auto status = client.status();
  if (!status) return false;
  if (status->identity == process.identity) return true;
  log::info("simulated rig at {}: of other options, asked to end", process.socket.string());
  const auto ended = client.end();
  if (!ended) log::warning("{}", ended.error().message);
  return false;
}

Result<void> wait_until_it_answers(const RigProcess& process,
                                   pid_t pid,
                                   const std::stop_token& stop) {
  const FileDescriptor child(::pidfd_open(pid, 0));
  const Deadline deadline = std::chrono::steady_clock::now() + process.patience;
  while (!answers(process)) {
    const auto ended =
        sim::wait_for(child.get(), POLLIN, std::chrono::steady_clock::now() + 20ms, stop);
    if (ended) {
      if (answers(process)) return ok();  // somebody else was quicker
      return unavailable(
          fmt::format("opaline-rig ended at once; see {}", log_of(process).string()));
    }
    if (ended.error().code != ErrorCode::kTimeout) return ended.error();
    if (std::chrono::steady_clock::now() >= deadline) {
      return timeout(fmt::format("opaline-rig does not answer; see {}", log_of(process).string()));
    }
  }
  return ok();
}

/// Whether the right rig answers. One that was asked to end, or does not answer yet, is given time to do either.
Result<bool> answers_in_the_end(const RigProcess& process, const std::stop_token& stop) {
  std::filesystem::path lock = process.socket;
  lock += ".lock";
  const Deadline deadline =
      std::chrono::steady_clock::now() + std::min<std::chrono::seconds>(process.patience, 10s);
  while (!answers(process)) {
    const auto held = FileLock::is_held(lock);
    if (!held || !*held) return false;
    const auto waited = sim::wait_for(-1, 0, std::chrono::steady_clock::now() + 100ms, stop);
    if (!waited && waited.error().code == ErrorCode::kCancelled) return waited.error();
    if (std::chrono::steady_clock::now() >= deadline) {
      return timeout(
          fmt::format("the rig at {} holds its lock, but neither answers nor ends; is it stopped?",
                      process.socket.string()));
    }
  }
  return true;
}

}  // namespace

std::string rig_identity(const config::SimConfig& sim) {
  config::SessionConfig session;
  session.rig.sim = sim;
  session.rig.sim.socket.clear();
  std::string text = config::to_toml(session);
  for (const SphereLight& light : sim.lights)
    text += fmt::format(
        "{},{},{},{};", light.position.x, light.position.y, light.position.z, light.intensity);
  if (const auto& beam = sim.balls.beam)
    text += fmt::format("{},{},{},{},{},{},{};",
                        beam->from.x,
                        beam->from.y,
                        beam->from.z,
                        beam->aim.x,
                        beam->aim.y,
                        beam->aim.z,
                        beam->power_w);
  text += version();
  text += sim::transport_key(sim.scene, sim.transport);  // has the algorithm's version
  text += transport_checksum(sim.responses).value_or("");
  return sha256_hex(std::as_bytes(std::span(text)));
}

namespace {

Result<std::unique_ptr<sim::Rig>> board_rig(const config::SimBoardConfig& board,
                                            const sim::RigOptions& options,
                                            Clock* clock) {
  const sim::BoardSceneOptions scene = config::board_scene(board, options);
  if (auto good = sim::validate(scene); !good) return good.error().in("sim.board");
  if (static_cast<int>(scene.poses.size()) < board.poses) {
    return invalid_argument(
        fmt::format("sim.board: {} of {} poses find a place in both pictures; expected a smaller "
                    "board, or one farther away",
                    scene.poses.size(),
                    board.poses));
  }
  return sim::Rig::create(
      options,
      std::make_shared<const sim::BoardOptics>(options.camera, options.projector, scene),
      clock);
}

Result<std::unique_ptr<sim::Rig>> holder_rig(const sim::HolderScene& holder,
                                             const sim::RigOptions& options,
                                             std::shared_ptr<const TransportResponses> responses,
                                             Clock* clock) {
  if (auto good = sim::validate(options); !good) return good.error().in("rig");
  if (auto good = sim::validate(holder); !good) return good.error().in("sim");
  if (auto good = sim::check_responses(*responses, options.camera.model); !good)
    return good.error().in("transport responses");
  const bool is_lit = options.projector.kind == sim::ProjectorKind::kPerspective &&
                      responses->lit_face == responses->seen_face;
  std::shared_ptr<const sim::LightPath> path;
  if (is_lit) {
    path = std::make_shared<const sim::LitHolderOptics>(
        options.camera, options.projector, std::move(responses), holder, options.surface);
  } else {
    path = std::make_shared<const sim::HolderOptics>(
        options.camera, options.projector, std::move(responses), holder, options.surface);
  }
  return sim::Rig::create(options, std::move(path), clock);
}

}  // namespace

Result<std::unique_ptr<sim::Rig>> build_rig(const config::SimConfig& sim,
                                            EventSink& events,
                                            std::stop_token stop,
                                            Clock* clock) {
  sim::RigOptions options = sim.rig;
  options.identity = rig_identity(sim);
  if (!sim.lights.empty()) {
    options.projector.width = static_cast<int>(sim.lights.size()) + 1;
    options.projector.height = 1;
    options.projector.color_wheel = false;
    options.projector.wheel_turn = std::chrono::milliseconds(1);
    auto object =
        sim::make_led_object(sim.balls, sim.lights, options.camera, events, std::move(stop));
    if (!object) return object.error();
    return sim::Rig::create(
        options, std::shared_ptr<const sim::LightPath>(*std::move(object)), clock);
  }
  if (sim.board.is_there()) return board_rig(sim.board, options, clock);
  if (sim.chart) {
    return sim::Rig::create(
        options,
        std::make_shared<const sim::ChartOptics>(
            options.camera, options.projector, sim::chart_before(options.camera)),
        clock);
  }
  auto responses = sim::load_or_compute(
      sim.scene, sim.transport, {sim.responses, sim.cache}, events, std::move(stop));
  if (!responses) return responses.error().in("light transport of the simulated sample");
  auto shared = std::make_shared<const TransportResponses>(*std::move(responses));
  if (sim.holder.is_there()) return holder_rig(sim.holder.scene, options, std::move(shared), clock);
  return sim::Rig::create(options, std::move(shared), clock);
}

Result<void> ensure_rig_process(const RigProcess& process, std::stop_token stop) {
  const auto there = answers_in_the_end(process, stop);
  if (!there) return there.error();
  if (*there) return ok();
  if (auto made = system_files().make_directories(process.socket.parent_path()); !made) return made;
  const auto pid = spawn(process);
  if (!pid) return pid.error();
  log::info("simulated rig: process {} at {}", *pid, process.socket.string());
  auto running = wait_until_it_answers(process, *pid, stop);
  if (!running) ::kill(*pid, SIGTERM);  // nobody would look after it
  return running;
}

}  // namespace opaline::daemon
