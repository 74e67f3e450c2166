#include "bench/faults/fault_bed.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <spawn.h>
#include <stdlib.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <random>
#include <system_error>
#include <utility>

#include "base/file_descriptor.h"
#include "base/files.h"
#include "base/session_directory.h"
#include "config/session_config.h"
#include "sim/rig_client.h"

namespace opaline::faults {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

constexpr auto kPatience = 300s;

constexpr const char* kSession = R"(name = "tiny"
rig = "rig.toml"
[sample]
name = "tiny block"
size = ["8 mm", "8 mm", "4 mm"]
cells = [8, 8, 4]
[capture]
regions = 2
held_out_lights = 2
[reconstruction]
max_iterations = 30
checkpoint_every = 2
threads = 1
)";

// The camera looks straight down on the middle of the block from 100 mm: 0.2 mm a pixel.
constexpr const char* kRig = R"([station]
name = "{station}"
[sim]
run = "process"
socket = "{socket}"
time_factor = {time_factor}
[sim.scene]
size = ["8 mm", "8 mm", "4 mm"]
cells = [8, 8, 4]
[sim.camera]
width = 64
height = 64
fx = 500.0
fy = 500.0
cx = 32.0
cy = 32.0
distortion = [0.0, 0.0, 0.0, 0.0, 0.0]
rotation = [1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, -1.0]
translation = ["-4 mm", "4 mm", "104 mm"]
[sim.projector]
width = 80
height = 60
mm_per_pixel = 0.2
offset_x_px = 20.0
offset_y_px = 10.0
[sim.transport]
cache = "{cache}"
patches = [4, 4]
photons_per_patch = 8192
)";

std::string rig_text(const fs::path& root, int time_factor) {
  return fmt::format(fmt::runtime(kRig),
                     fmt::arg("station", root.filename().string()),
                     fmt::arg("socket", (root / "rig.sock").string()),
                     fmt::arg("time_factor", time_factor),
                     fmt::arg("cache", (root / "cache").string()));
}

// A pidfd. glibc 2.36 declares pidfd_open() for C only.
int open_process(pid_t pid) { return static_cast<int>(::syscall(SYS_pidfd_open, pid, 0)); }

Result<void> append_files(const fs::path& session, const fs::path& path, FileList& files) {
  auto bytes = read_bytes(path, std::size_t{1} << 30);
  if (!bytes) return bytes.error();
  files.emplace_back(fs::relative(path, session).string(), *std::move(bytes));
  return ok();
}

std::string tail_of(const fs::path& log) {
  const auto text = read_text(log);
  if (!text) return {};
  constexpr std::size_t kTail = 600;
  return text->size() <= kTail ? *text : text->substr(text->size() - kTail);
}

}  // namespace

Result<std::unique_ptr<JobProcess>> JobProcess::start(const fs::path& program,
                                                      const fs::path& session,
                                                      const fs::path& log) {
  std::string name = program.string();
  std::string argument = session.string();
  char* const argv[] = {name.data(), argument.data(), nullptr};
  posix_spawn_file_actions_t actions;
  ::posix_spawn_file_actions_init(&actions);
  ::posix_spawn_file_actions_addopen(&actions, 1, log.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0600);
  ::posix_spawn_file_actions_adddup2(&actions, 1, 2);
  pid_t pid = 0;
  const int failed = ::posix_spawn(&pid, name.c_str(), &actions, nullptr, argv, environ);
  ::posix_spawn_file_actions_destroy(&actions);
  if (failed != 0) {
    return unavailable(
        fmt::format("cannot start {}: {}", name, std::generic_category().message(failed)));
  }
  return std::unique_ptr<JobProcess>(new JobProcess(pid));
}

JobProcess::~JobProcess() {
  if (status_) return;
  kill();
  ::waitpid(pid_, nullptr, 0);
}

Result<int> JobProcess::wait(std::chrono::nanoseconds patience) {
  if (status_) return *status_;
  const FileDescriptor process(open_process(pid_));
  pollfd poll{process.get(), POLLIN, 0};
  timespec limit{};
  limit.tv_sec = std::chrono::duration_cast<std::chrono::seconds>(patience).count();
  limit.tv_nsec = (patience % 1s).count();
  if (::ppoll(&poll, 1, &limit, nullptr) <= 0) return timeout(fmt::format("{} runs on", pid_));
  int status = 0;
  ::waitpid(pid_, &status, 0);
  status_ = WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status);
  return *status_;
}

void JobProcess::kill() {
  if (!status_) ::kill(pid_, SIGKILL);
}

Result<std::unique_ptr<FaultBed>> FaultBed::create(const Options& options) {
  std::string name = (fs::temp_directory_path() / "opaline-faults-XXXXXX").string();
  if (::mkdtemp(name.data()) == nullptr) return unavailable("no temporary directory");
  std::unique_ptr<FaultBed> bed(new FaultBed(options, name));
  ::setenv("OPALINE_LOCK_DIR", name.c_str(), 1);
  const auto written = write_whole(system_files(), fs::path(name) / "session.toml", kSession);
  if (!written) return written.error();
  const auto rig =
      write_whole(system_files(), fs::path(name) / "rig.toml", rig_text(name, options.time_factor));
  if (!rig) return rig.error();
  return bed;
}

FaultBed::~FaultBed() {
  if (fs::exists(rig_socket())) {
    const auto ended = sim::RigClient(rig_socket()).end();
    if (!ended) fmt::print(stderr, "{}\n", ended.error().message);
  }
  std::error_code ignored;
  fs::remove_all(root_, ignored);
}

fs::path FaultBed::log_of(const fs::path& session) const {
  return root_ / (session.filename().string() + ".log");
}

Result<fs::path> FaultBed::new_session() {
  const auto contents = config::read_contents(root_ / "session.toml");
  if (!contents) return contents.error();
  const fs::path path = root_ / fmt::format("session-{}", ++sessions_);
  const auto session = SessionDirectory::create(system_files(), path, *contents);
  if (!session) return session.error();
  return path;
}

Result<std::unique_ptr<JobProcess>> FaultBed::start(const std::string& program,
                                                    const fs::path& session) const {
  return JobProcess::start(options_.programs / program, session, log_of(session));
}

Result<void> FaultBed::complete(const std::string& program, const fs::path& session) const {
  const auto job = start(program, session);
  if (!job) return job.error();
  const auto status = (*job)->wait(kPatience);
  if (!status) return status.error();
  if (*status == 0) return ok();
  return internal_error(fmt::format(
      "{} {}: status {}:\n{}", program, session.string(), *status, tail_of(log_of(session))));
}

Result<bool> FaultBed::kill_and_complete(const std::string& program,
                                         const fs::path& session,
                                         std::chrono::nanoseconds after) const {
  const auto job = start(program, session);
  if (!job) return job.error();
  const bool alive = !(*job)->wait(after).has_value();
  (*job)->kill();
  const auto status = (*job)->wait(kPatience);
  if (!status) return status.error();
  if (auto done = complete(program, session); !done) return done.error();
  return alive && *status == 128 + SIGKILL;
}

Result<FileList> contents_of(const fs::path& session, const std::vector<std::string>& entries) {
  FileList files;
  for (const std::string& entry : entries) {
    const fs::path path = session / entry;
    if (!fs::is_directory(path)) {
      if (auto added = append_files(session, path, files); !added) return added.error();
      continue;
    }
    for (const auto& file : fs::recursive_directory_iterator(path)) {
      const bool whole = file.is_regular_file() && file.path().extension() != ".partial";
      if (!whole) continue;
      if (auto added = append_files(session, file.path(), files); !added) return added.error();
    }
  }
  std::ranges::sort(files);
  return files;
}

Result<FileList> capture_results(const fs::path& session) {
  return contents_of(session, {"hdr", "dataset.exr", "dataset_light.exr", "dataset.json"});
}

std::vector<std::chrono::nanoseconds> moments(std::chrono::nanoseconds length,
                                              int count,
                                              std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> share;
  std::vector<std::chrono::nanoseconds> all;
  for (int i = 0; i < count; ++i) {
    const double at = (i + share(random)) / count * static_cast<double>(length.count());
    all.emplace_back(static_cast<std::chrono::nanoseconds::rep>(at));
  }
  return all;
}

}  // namespace opaline::faults
