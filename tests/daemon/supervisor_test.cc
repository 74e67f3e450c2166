#include "daemon/supervisor.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <cstdlib>
#include <fstream>

#include "base/lock.h"
#include "daemon/cancel_wish.h"
#include "daemon/jobs/control_client.h"
#include "daemon/jobs/station_lock.h"
#include "tests/support/named_directory.h"
#include "tests/support/process.h"
#include "tests/support/temporary_directory.h"

namespace opaline::daemon {
namespace {

using namespace std::chrono_literals;
using testing::eventually;
using ::testing::HasSubstr;

/// Sessions on the fake stages, supervised step by step or by a thread.
class Supervision : public ::testing::Test {
 protected:
  Supervision() {
    std::filesystem::create_directories(switches_);
    ::setenv("OPALINE_FAKE_DIR", switches_.c_str(), 1);
    ::setenv("OPALINE_LOCK_DIR", root_.path().c_str(), 1);
    ::setenv("OPALINE_FAKE_STATION", "bench", 1);
  }

  SessionDirectory make_session(const std::string& id) const {
    return *SessionDirectory::create(system_files(), root_.path() / id, {id, "", "", ""});
  }
  void turn_on(const std::string& what, const std::string& text = "") const {
    std::ofstream(switches_ / what) << text;
  }
  void turn_off(const std::string& what) const { std::filesystem::remove(switches_ / what); }
  std::unique_ptr<Supervisor> make_supervisor() {
    return std::make_unique<Supervisor>(
        neighbours_,
        Supervisor::Hooks{[](const SessionDirectory&) { return station_lock_path("bench"); },
                          [](const SessionSnapshot&) {}},
        Supervisor::Options{
            std::chrono::milliseconds(5),
            {.period = 10ms, .terminate_after = terminate_after_, .kill_after = kill_after_}});
  }
  static void cancel(Supervisor& supervisor, const SessionDirectory& session) {
    EXPECT_TRUE(wish_cancel(system_files(), session));
    supervisor.add(session);  // looks at once
  }
  static SessionState state_of(const SessionDirectory& session) {
    const auto snapshot = read_snapshot(session);
    return snapshot ? snapshot->state : SessionState::kQueued;
  }
  static bool becomes(const SessionDirectory& session, SessionState state) {
    return eventually([&] { return state_of(session) == state; });
  }

  // The number of the job that holds; 0 before it answers.
  static pid_t holder_of(const SessionDirectory& session) {
    const auto status = ask_job(session.control_socket(), {{"command", "status"}});
    return status && status->at("progress").is_object() ? status->at("pid").get<pid_t>() : 0;
  }
  static bool holds(const SessionDirectory& session) {
    return eventually([&] { return holder_of(session) != 0; });
  }

  testing::TemporaryDirectory root_;
  std::filesystem::path switches_ = root_.path() / "switches";
  LocalExecutor executor_{opaline::testing::named_directory("OPALINE_FAKES")};
  SystemClock clock_;
  std::chrono::nanoseconds terminate_after_ = 1min;
  std::chrono::nanoseconds kill_after_ = 2min;
  SessionSupervisor::Neighbours neighbours_{executor_, system_files(), clock_};
};

TEST_F(Supervision, TakesASessionThroughAllStages) {
  const SessionDirectory session = make_session("a");
  const auto supervisor = make_supervisor();
  supervisor->add(session);

  EXPECT_TRUE(becomes(session, SessionState::kSucceeded));
  EXPECT_TRUE(std::filesystem::exists(session.path() / "preview.html"));
}

TEST_F(Supervision, StartsAJobThatDiedAgain) {
  turn_on("capture.die", "2");
  const SessionDirectory session = make_session("a");
  const auto supervisor = make_supervisor();
  supervisor->add(session);

  EXPECT_TRUE(becomes(session, SessionState::kSucceeded));
}

TEST_F(Supervision, GivesUpOnAJobThatAlwaysDiesAndSaysSoInTheLog) {
  turn_on("capture.die", "99");
  const SessionDirectory session = make_session("a");
  const auto supervisor = make_supervisor();
  supervisor->add(session);

  EXPECT_TRUE(becomes(session, SessionState::kFailed));
  EXPECT_THAT(read_snapshot(session)->message, HasSubstr("died 3 times"));
}

TEST_F(Supervision, SaysWhenAProgramIsMissing) {
  LocalExecutor nowhere(root_.path() / "nowhere");
  const SessionDirectory session = make_session("a");
  SessionSupervisor supervisor(session, {}, {nowhere, system_files(), clock_});
  BusyStations stations;
  ASSERT_TRUE(supervisor.step(stations));
  const auto snapshot = supervisor.step(stations);

  ASSERT_TRUE(snapshot);
  EXPECT_EQ(snapshot->state, SessionState::kFailed);
  EXPECT_THAT(snapshot->message, HasSubstr("nowhere/opaline-capture"));
}

TEST_F(Supervision, StopsAtAStageThatFailsAndGoesOnWhenResumed) {
  turn_on("reconstruct.fail", "no memory");
  const SessionDirectory session = make_session("a");
  const auto supervisor = make_supervisor();
  supervisor->add(session);
  ASSERT_TRUE(becomes(session, SessionState::kFailed));
  EXPECT_EQ(read_snapshot(session)->message, "no memory");

  turn_off("reconstruct.fail");
  ASSERT_TRUE(SessionSupervisor(session, {}, neighbours_).resume());
  ASSERT_TRUE(eventually([&] {
    supervisor->add(session);  // once it has let go of the failed one
    return state_of(session) == SessionState::kSucceeded;
  }));
}

TEST_F(Supervision, QueuesTwoSessionsOnOneStation) {
  turn_on("capture.hold");
  const SessionDirectory first = make_session("a");
  const SessionDirectory second = make_session("b");
  const auto supervisor = make_supervisor();
  supervisor->add(first);
  supervisor->add(second);

  EXPECT_TRUE(eventually([&] {
    const auto snapshot = supervisor->snapshot("b");
    return snapshot && snapshot->state == SessionState::kWaiting;
  }));
  EXPECT_TRUE(becomes(first, SessionState::kRunning));
  turn_off("capture.hold");
  EXPECT_TRUE(becomes(first, SessionState::kSucceeded));
  EXPECT_TRUE(becomes(second, SessionState::kSucceeded));
}

TEST_F(Supervision, SaysWhyAStationsLockCannotBeLookedAt) {
  std::ofstream(root_.path() / "file") << "no directory";
  SessionSupervisor supervisor(make_session("a"), root_.path() / "file" / "lock", neighbours_);
  BusyStations stations;

  const auto snapshot = supervisor.step(stations);

  ASSERT_TRUE(snapshot);
  EXPECT_EQ(snapshot->state, SessionState::kWaiting);
  EXPECT_THAT(snapshot->message, HasSubstr("Not a directory"));
}

TEST_F(Supervision, CancelsARunningSession) {
  turn_on("capture.hold");
  const SessionDirectory session = make_session("a");
  const auto supervisor = make_supervisor();
  supervisor->add(session);
  ASSERT_TRUE(becomes(session, SessionState::kRunning));

  cancel(*supervisor, session);

  EXPECT_TRUE(becomes(session, SessionState::kCancelled));
}

TEST_F(Supervision, CancelsASessionThatWaits) {
  const auto station = lock_station("bench");
  ASSERT_TRUE(station);
  const SessionDirectory session = make_session("a");
  const auto supervisor = make_supervisor();
  supervisor->add(session);
  ASSERT_TRUE(eventually([&] { return supervisor->snapshot("a").has_value(); }));

  cancel(*supervisor, session);

  EXPECT_TRUE(becomes(session, SessionState::kCancelled));
}

TEST_F(Supervision, KillsAJobThatDoesNotListen) {
  turn_on("capture.hold");
  turn_on("capture.deaf");
  terminate_after_ = 50ms;
  kill_after_ = 150ms;
  const SessionDirectory session = make_session("a");
  const auto supervisor = make_supervisor();
  supervisor->add(session);
  ASSERT_TRUE(becomes(session, SessionState::kRunning));

  cancel(*supervisor, session);

  EXPECT_TRUE(becomes(session, SessionState::kCancelled));
}

TEST_F(Supervision, TerminatesAJobWhoseSocketIsGone) {
  turn_on("capture.hold");
  terminate_after_ = 50ms;
  const SessionDirectory session = make_session("a");
  const auto supervisor = make_supervisor();
  supervisor->add(session);
  ASSERT_TRUE(holds(session));
  ASSERT_TRUE(std::filesystem::remove(session.control_socket()));

  cancel(*supervisor, session);

  ASSERT_TRUE(becomes(session, SessionState::kCancelled));
  EXPECT_EQ(read_snapshot(session)->stages[0].state, StageState::kInterrupted);
}

TEST_F(Supervision, KillsAStoppedJobOfAnotherSupervisorWhileOthersGoOn) {
  turn_on("capture.hold");
  const SessionDirectory session = make_session("a");
  {
    const auto supervisor = make_supervisor();
    supervisor->add(session);
    ASSERT_TRUE(holds(session));
  }
  const pid_t job = holder_of(session);
  ASSERT_GT(job, 0);
  ASSERT_EQ(::kill(job, SIGSTOP), 0);
  terminate_after_ = 200ms;
  kill_after_ = 500ms;
  const auto supervisor = make_supervisor();
  supervisor->add(session);
  cancel(*supervisor, session);

  const SessionDirectory other = make_session("b");
  const auto before = clock_.now();
  supervisor->add(other);  // does not wait for the one that hangs
  EXPECT_LT(clock_.now() - before, 200ms);

  EXPECT_TRUE(becomes(session, SessionState::kCancelled));
  turn_off("capture.hold");
  EXPECT_TRUE(becomes(other, SessionState::kSucceeded));
}

TEST_F(Supervision, RemembersAWishToCancelThatNoSupervisorSaw) {
  turn_on("capture.hold");
  const SessionDirectory session = make_session("a");
  {
    const auto supervisor = make_supervisor();
    supervisor->add(session);
    ASSERT_TRUE(becomes(session, SessionState::kRunning));
  }
  ASSERT_TRUE(wish_cancel(system_files(), session));

  const auto supervisor = make_supervisor();
  supervisor->add(session);

  EXPECT_TRUE(becomes(session, SessionState::kCancelled));
}

TEST_F(Supervision, ForgetsTheWishToCancelWhenResumedAtOnce) {
  turn_on("capture.hold");
  const SessionDirectory session = make_session("a");
  SessionSupervisor supervisor(session, {}, neighbours_);
  const auto step = [&] {
    BusyStations stations;
    return supervisor.step(stations);
  };
  ASSERT_TRUE(step());
  ASSERT_TRUE(holds(session));
  ASSERT_TRUE(wish_cancel(system_files(), session));
  ASSERT_TRUE(step());  // asks; the job ends before the next look
  ASSERT_TRUE(becomes(session, SessionState::kCancelled));

  turn_off("capture.hold");
  ASSERT_TRUE(SessionSupervisor(session, {}, neighbours_).resume());

  EXPECT_TRUE(eventually([&] { return step() && state_of(session) == SessionState::kSucceeded; }));
}

TEST_F(Supervision, GoesOnWhereAnotherSupervisorStopped) {
  turn_on("capture.hold");
  const SessionDirectory session = make_session("a");
  make_supervisor()->add(session);  // starts the job, then is gone
  std::unique_ptr<Supervisor> supervisor = make_supervisor();
  supervisor->add(session);
  ASSERT_TRUE(becomes(session, SessionState::kRunning));
  supervisor.reset();
  ASSERT_EQ(state_of(session), SessionState::kRunning);

  supervisor = make_supervisor();
  supervisor->add(session);
  turn_off("capture.hold");

  EXPECT_TRUE(becomes(session, SessionState::kSucceeded));
}

}  // namespace
}  // namespace opaline::daemon
