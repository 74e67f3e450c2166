// A stage that does nothing but behave, over the same frame as the real ones. FAKE_STAGE is its name; files in
// the directory that OPALINE_FAKE_DIR names say how it behaves:
//   STAGE.hold  works (progress, a fact at the start) while the file exists, and stops when asked
//   STAGE.deaf  while holding, does not stop when asked
//   STAGE.die   a number: kills itself with SIGKILL that many times, after one fact if STAGE.works exists
//   STAGE.fail  fails with the file's text
// The capture stage holds the station that OPALINE_FAKE_STATION names.
#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "base/clock.h"
#include "daemon/jobs/job.h"
#include "daemon/jobs/station_lock.h"

namespace {

using namespace opaline;  // NOLINT(google-build-using-namespace)

std::filesystem::path switch_file(const std::string& what) {
  const char* directory = std::getenv("OPALINE_FAKE_DIR");
  return std::filesystem::path(directory == nullptr ? "/nonexistent" : directory) /
         fmt::format("{}.{}", FAKE_STAGE, what);
}

bool is_on(const std::string& what) {
  std::error_code none;
  return std::filesystem::exists(switch_file(what), none);
}

Result<void> maybe_die(daemon::JobContext& context) {
  const Result<std::string> text = read_text(switch_file("die"));
  const int times = text ? std::atoi(text->c_str()) : 0;
  if (times <= 0) return ok();
  if (auto written = write_whole(context.files, switch_file("die"), std::to_string(times - 1));
      !written) {
    return written;
  }
  if (is_on("works")) {
    if (auto logged = context.events.fact("fake.worked", {{"left", times}}); !logged) return logged;
  }
  ::kill(::getpid(), SIGKILL);
  return internal_error("survived");
}

Result<void> hold(daemon::JobContext& context) {
  SystemClock clock;
  for (int i = 0; is_on("hold"); ++i) {
    context.events.progress({"holding", 0.5, 1.5, {{"turn", i}}});
    const bool deaf = is_on("deaf");
    if (!clock.sleep(std::chrono::milliseconds(2), deaf ? std::stop_token() : context.stop)) {
      return cancelled("asked to stop");
    }
  }
  return ok();
}

Result<void> work(daemon::JobContext& context) {
  if (auto died = maybe_die(context); !died) return died;
  if (is_on("fail")) return unavailable(read_text(switch_file("fail")).value_or(""));
  if (is_on("throw")) throw std::runtime_error("thrown");
  if (auto logged = context.events.fact("fake.began", {{"stage", FAKE_STAGE}}); !logged)
    return logged;
  if (auto held = hold(context); !held) return held;
  const auto output = context.session.path() / (std::string(FAKE_STAGE) + ".html");
  return write_whole(context.files, output, std::string(300'000, 'x'));
}

Result<void> run(daemon::JobContext& context) {
  const char* station = std::getenv("OPALINE_FAKE_STATION");
  if (std::string(FAKE_STAGE) != "capture" || station == nullptr) return work(context);
  const auto lock = daemon::lock_station(station);
  return lock ? work(context) : Result<void>(lock.error());
}

}  // namespace

int main(int argc, char** argv) {
  return opaline::daemon::run_job(argc, argv, {FAKE_STAGE, "Pretends to work, for tests."}, run);
}
