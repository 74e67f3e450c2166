#include "daemon/jobs/job.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <cstdlib>
#include <fstream>

#include "base/event_log.h"
#include "base/lock.h"
#include "daemon/jobs/control_client.h"
#include "daemon/jobs/station_lock.h"
#include "tests/support/named_directory.h"
#include "tests/support/process.h"
#include "tests/support/temporary_directory.h"

namespace opaline::daemon {
namespace {

using testing::eventually;
using ::testing::HasSubstr;
using testing::Process;

class Job : public ::testing::Test {
 protected:
  Job() {
    EXPECT_TRUE(SessionDirectory::create(system_files(), directory_, {"test", "", "", ""}));
    std::filesystem::create_directories(switches_);
  }

  std::string program() const {
    return opaline::testing::named_directory("OPALINE_FAKES").string() + "/opaline-capture";
  }
  Process::Environment environment() const {
    return {{"OPALINE_FAKE_DIR", switches_.string()},
            {"OPALINE_LOCK_DIR", root_.path().string()},
            {"OPALINE_FAKE_STATION", "bench"}};
  }
  int run() const {
    return Process({program(), directory_.string()}, environment(), root_.path() / "out").wait();
  }
  void turn_on(const std::string& what, const std::string& text = "") const {
    std::ofstream(switches_ / ("capture." + what)) << text;
  }
  nlohmann::json last_event() const {
    const auto batch = read_events(directory_ / "events.jsonl");
    return batch && !batch->events.empty() ? batch->events.back().data : nlohmann::json();
  }
  bool holds() const {
    const auto status = ask_job(directory_ / "control.sock", {{"command", "status"}});
    return status && status->at("progress").is_object();
  }

  testing::TemporaryDirectory root_;
  // Longer than a socket's name may be.
  std::filesystem::path directory_ =
      root_.path() / std::string(120, 's') / "20260101-000000-aaaaaa-test";
  std::filesystem::path switches_ = root_.path() / "switches";
};

TEST_F(Job, LogsItsStartAndItsEndAndExitsWithNought) {
  EXPECT_EQ(run(), 0);

  const auto batch = read_events(directory_ / "events.jsonl");
  ASSERT_TRUE(batch);
  EXPECT_EQ(batch->events.front().type, "job.started");
  EXPECT_EQ(batch->events.front().data["job"], "capture");
  EXPECT_EQ(batch->events.back().type, "job.finished");
  EXPECT_EQ(batch->events.back().data["outcome"], "succeeded");
}

TEST_F(Job, ReportsAnErrorInTheLogAndByItsExitStatus) {
  turn_on("fail", "the lamp is cold");

  EXPECT_EQ(run(), 1);
  EXPECT_EQ(last_event()["outcome"], "failed");
  EXPECT_EQ(last_event()["code"], "unavailable");
  EXPECT_EQ(last_event()["message"], "the lamp is cold");
}

TEST_F(Job, ReportsAThrownExceptionAsAFailure) {
  turn_on("throw");

  EXPECT_EQ(run(), 1);
  EXPECT_EQ(last_event()["message"], "thrown");
}

TEST_F(Job, ExitsWithFourWhenAnotherHoldsTheSession) {
  const auto lock = FileLock::acquire(directory_ / "lock");
  ASSERT_TRUE(lock);

  EXPECT_EQ(run(), 4);
  EXPECT_FALSE(std::filesystem::exists(directory_ / "events.jsonl"));
}

TEST_F(Job, ExitsWithFourWhenAnotherHoldsTheStation) {
  ::setenv("OPALINE_LOCK_DIR", root_.path().c_str(), 1);
  const auto lock = lock_station("bench");
  ASSERT_TRUE(lock);

  EXPECT_EQ(run(), 4);
  EXPECT_EQ(last_event()["code"], "busy");
}

TEST_F(Job, RefusesASessionOfANewerVersion) {
  std::ofstream(directory_ / "session.json") << R"({"format":2,"name":"test"})";

  Process process({program(), directory_.string()}, environment(), root_.path() / "out");

  EXPECT_EQ(process.wait(), 2);
  EXPECT_THAT(process.output(), HasSubstr("written by a newer version"));
  EXPECT_FALSE(std::filesystem::exists(directory_ / "events.jsonl"));
}

TEST_F(Job, RefusesBadUsage) {
  Process process({program()}, environment(), root_.path() / "out");

  EXPECT_EQ(process.wait(), 2);
  EXPECT_THAT(process.output(), HasSubstr("Usage: opaline-capture SESSION_DIR"));
}

TEST_F(Job, StopsCleanlyOnASignalWhichASupervisorMayUndo) {
  turn_on("hold");
  Process process({program(), directory_.string()}, environment(), root_.path() / "out");
  ASSERT_TRUE(eventually([&] { return holds(); }));

  process.kill(SIGTERM);

  EXPECT_EQ(process.wait(), 3);
  EXPECT_EQ(last_event()["outcome"], "cancelled");
  EXPECT_EQ(last_event()["by"], "signal");
  EXPECT_FALSE(std::filesystem::exists(directory_ / "control.sock"));
}

TEST_F(Job, AnswersAtItsSocketAndIsCancelledThroughIt) {
  turn_on("hold");
  Process process({program(), directory_.string()}, environment(), root_.path() / "out");
  ASSERT_TRUE(eventually([&] { return holds(); }));
  const auto socket = directory_ / "control.sock";

  const auto status = ask_job(socket, {{"command", "status"}});
  const auto unknown = ask_job(socket, {{"command", "dance"}});
  const auto too_long = ask_job(socket, {{"command", std::string(5000, 'x')}});
  ASSERT_TRUE(ask_job(socket, {{"command", "cancel"}}));

  ASSERT_TRUE(status);
  EXPECT_EQ(status->at("pid"), process.pid());
  EXPECT_EQ(status->at("progress")["step"], "holding");
  ASSERT_FALSE(unknown);
  EXPECT_EQ(unknown.error().code, ErrorCode::kInvalidArgument);
  EXPECT_FALSE(too_long);
  EXPECT_EQ(process.wait(), 3);
  EXPECT_EQ(last_event()["by"], "request");
}

TEST_F(Job, TakesOverTheSocketOfOneThatDied) {
  turn_on("hold");
  {
    Process process({program(), directory_.string()}, environment(), root_.path() / "out");
    ASSERT_TRUE(eventually([&] { return holds(); }));
  }  // killed
  Process process({program(), directory_.string()}, environment(), root_.path() / "out");

  EXPECT_TRUE(eventually([&] {
    const auto status = ask_job(directory_ / "control.sock", {{"command", "status"}});
    return status && status->at("pid") == process.pid();
  }));
}

}  // namespace
}  // namespace opaline::daemon
