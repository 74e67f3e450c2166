// The daemon as a client sees it.

#include <gmock/gmock.h>

#include "base/event_log.h"
#include "base/lock.h"
#include "daemon/jobs/control_client.h"
#include "tests/api/opalined_fixture.h"

namespace opaline::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

class Opalined : public OpalinedTest {};

TEST_F(Opalined, TakesASessionToItsEndAndServesWhatCameOut) {
  start();
  const HttpReply created = ask("POST", "/v1/sessions", wish());
  ASSERT_EQ(created.status, 202) << created.body;
  const std::string id = created.json()["id"];
  EXPECT_EQ(created.headers.at("location"), "/v1/sessions/" + id);
  ASSERT_TRUE(becomes(id, "succeeded"));

  const nlohmann::json list = ask("GET", "/v1/sessions/" + id + "/artefacts").json();
  const HttpReply file = ask("GET", "/v1/sessions/" + id + "/artefacts/preview.html");

  EXPECT_THAT(list.dump(), HasSubstr(R"("name":"preview.html","size":300000)"));
  EXPECT_THAT(list.dump(), Not(HasSubstr("lock")));
  EXPECT_EQ(file.status, 200);
  EXPECT_EQ(file.body, std::string(300000, 'x'));
  EXPECT_THAT(file.headers.at("content-security-policy"), HasSubstr("sandbox"));
}

TEST_F(Opalined, SaysThatItIsWell) {
  start();
  EXPECT_EQ(ask("GET", "/healthz").json()["status"], "ok");
  EXPECT_EQ(ask_tcp("GET", "/healthz").status, 200);
  EXPECT_EQ(ask("GET", "/v1/status").json()["sessions_directory"], sessions_.string());
}

TEST_F(Opalined, KilledItLeavesTheJobRunningAndStartedAgainItFinishesTheSession) {
  turn_on("capture.hold");
  start();
  const std::string id = create();
  ASSERT_TRUE(becomes(id, "running"));
  const auto log = sessions_ / id / "events.jsonl";
  ASSERT_TRUE(eventually([&] { return std::filesystem::exists(log); }));
  const std::uint16_t port_before = port();

  daemon_->kill(SIGKILL);
  daemon_->wait();
  const auto size = std::filesystem::file_size(log);
  EXPECT_TRUE(eventually([&] { return std::filesystem::file_size(log) > size; }));
  start({}, port_before);  // the job holds nothing of the first one's

  EXPECT_EQ(state_of(id), "running");
  turn_off("capture.hold");
  EXPECT_TRUE(becomes(id, "succeeded"));
}

TEST_F(Opalined, StopsCleanlyOnASignalAndLeavesTheJobRunning) {
  turn_on("capture.hold");
  start();
  const std::string id = create();
  ASSERT_TRUE(becomes(id, "running"));
  ASSERT_TRUE(
      eventually(  // the job holds its session: before, only the daemon that started it knows
          [&] { return std::filesystem::exists(sessions_ / id / "events.jsonl"); }));

  daemon_->kill(SIGTERM);

  EXPECT_EQ(daemon_->wait(), 0);
  EXPECT_FALSE(std::filesystem::exists(socket_));
  start();
  EXPECT_EQ(state_of(id), "running");
  turn_off("capture.hold");
  EXPECT_TRUE(becomes(id, "succeeded"));
}

TEST_F(Opalined, CancelsOnceAndDeletesOnlyWhatIsOver) {
  turn_on("capture.hold");
  start();
  const std::string id = create();
  ASSERT_TRUE(becomes(id, "running"));
  EXPECT_EQ(ask("DELETE", "/v1/sessions/" + id).status, 409);

  EXPECT_EQ(ask("POST", "/v1/sessions/" + id + "/cancel").status, 202);
  ASSERT_TRUE(becomes(id, "cancelled"));

  EXPECT_EQ(ask("POST", "/v1/sessions/" + id + "/cancel").status, 409);
  EXPECT_EQ(ask("DELETE", "/v1/sessions/" + id).status, 204);
  EXPECT_EQ(ask("GET", "/v1/sessions/" + id).status, 404);
  EXPECT_TRUE(ask("GET", "/v1/sessions").json()["sessions"].empty());
  EXPECT_TRUE(eventually([&] { return !std::filesystem::exists(sessions_ / (".removed-" + id)); }));
}

TEST_F(Opalined, RemovesWhatAnInterruptedRemovalLeftAndForgetsWhatIsMissing) {
  start();
  const std::string id = create();
  ASSERT_TRUE(becomes(id, "succeeded"));
  daemon_->kill(SIGTERM);
  daemon_->wait();
  std::filesystem::rename(sessions_ / id, sessions_ / (".removed-" + id));

  start();

  EXPECT_TRUE(ask("GET", "/v1/sessions").json()["sessions"].empty());
  EXPECT_TRUE(ask("GET", "/v1/status").json()["counts"].empty());
  EXPECT_TRUE(eventually([&] { return !std::filesystem::exists(sessions_ / (".removed-" + id)); }));
}

TEST_F(Opalined, CountsEverySessionAndShowsThoseThatAreNotOver) {
  start();
  ASSERT_TRUE(becomes(create(), "succeeded"));
  turn_on("capture.hold");
  const std::string id = create();
  EXPECT_EQ(ask("GET", "/v1/status").json()["active"][0]["id"], id);
  ASSERT_TRUE(becomes(id, "running"));

  EXPECT_TRUE(eventually([&] {
    const nlohmann::json status = ask("GET", "/v1/status").json();
    return status["counts"] == nlohmann::json{{"running", 1}, {"succeeded", 1}} &&
           status["active"].size() == 1 && status["active"][0].contains("progress");
  }));
}

TEST_F(Opalined, ResumesWhatFailed) {
  turn_on("reconstruct.fail", "no memory");
  start();
  const std::string id = create();
  ASSERT_TRUE(becomes(id, "failed"));
  EXPECT_EQ(ask("GET", "/v1/sessions/" + id).json()["message"], "no memory");

  turn_off("reconstruct.fail");
  EXPECT_EQ(ask("POST", "/v1/sessions/" + id + "/resume").status, 202);

  EXPECT_TRUE(becomes(id, "succeeded"));
  EXPECT_EQ(ask("POST", "/v1/sessions/" + id + "/resume").status, 409);
}

TEST_F(Opalined, TakesUpWhatWasResumedWithoutItsKnowing) {
  turn_on("reconstruct.fail", "no memory");
  start();
  const std::string id = create();
  ASSERT_TRUE(becomes(id, "failed"));
  ASSERT_TRUE(eventually([&] {  // in the catalogue, too
    return ask("GET", "/v1/sessions").json()["sessions"][0]["state"] == "failed";
  }));
  daemon_->kill(SIGKILL);
  daemon_->wait();
  turn_off("reconstruct.fail");
  const auto log = EventLog::open(system_files(), sessions_ / id / "events.jsonl");
  ASSERT_TRUE(log && (*log)->append("session.resumed", nlohmann::json::object()));

  start();

  EXPECT_TRUE(becomes(id, "succeeded"));
}

TEST_F(Opalined, StartsAgainAJobThatASignalInterrupted) {
  turn_on("capture.hold");
  start();
  const std::string id = create();
  const auto job = [&] {
    const auto status = daemon::ask_job(sessions_ / id / "control.sock", {{"command", "status"}});
    return status && status->at("progress").is_object() ? status->at("pid").get<pid_t>() : 0;
  };
  for (int i = 0; i < 4; ++i) {  // more often than a stage may die
    pid_t pid = 0;
    ASSERT_TRUE(eventually([&] { return (pid = job()) != 0; }));
    ASSERT_EQ(::kill(pid, SIGTERM), 0);
    ASSERT_TRUE(eventually([&] { return job() != pid; }));
  }
  turn_off("capture.hold");

  EXPECT_TRUE(becomes(id, "succeeded"));
}

TEST_F(Opalined, QueuesASecondSessionOfTheSameStation) {
  turn_on("capture.hold");
  start();
  const std::string first = create();
  ASSERT_TRUE(becomes(first, "running"));
  const std::string second = create();

  EXPECT_TRUE(becomes(second, "waiting for station"));
  turn_off("capture.hold");
  EXPECT_TRUE(becomes(second, "succeeded"));
}

TEST_F(Opalined, LetsNoSecondJobOnASession) {
  turn_on("capture.hold");
  start();
  const std::string id = create();
  ASSERT_TRUE(becomes(id, "running"));
  ASSERT_TRUE(
      eventually([&] { return FileLock::is_held(sessions_ / id / "lock").value_or(false); }));

  Process second({fakes() + "/opaline-capture", (sessions_ / id).string()},
                 environment(),
                 root_.path() / "second.out");

  EXPECT_EQ(second.wait(), 4);
  EXPECT_THAT(second.output(), HasSubstr("another job works on session"));
}

TEST_F(Opalined, StreamsEventsFromWhereAClientStopped) {
  start();
  const std::string id = create();
  const HttpReply all = ask("GET", "/v1/sessions/" + id + "/events");
  const HttpReply since = ask("GET", "/v1/sessions/" + id + "/events?since=2");
  const HttpReply header = ask("GET", "/v1/sessions/" + id + "/events", "", "Last-Event-ID: 2\r\n");

  EXPECT_EQ(all.headers.at("content-type"), "text/event-stream");
  EXPECT_THAT(all.body, HasSubstr("id: 1\nevent: job.started\n"));
  EXPECT_THAT(all.body, HasSubstr("event: state\ndata: {"));
  EXPECT_THAT(all.body, HasSubstr(R"("state":"succeeded")"));
  EXPECT_THAT(since.body, Not(HasSubstr("id: 2\n")));
  EXPECT_THAT(since.body, HasSubstr("id: 3\n"));
  EXPECT_EQ(header.body, since.body);
  EXPECT_EQ(ask("GET", "/v1/sessions/" + id + "/events?since=x").status, 400);
}

TEST_F(Opalined, RefusesASessionOfANewerVersion) {
  std::filesystem::create_directories(sessions_ / "20260101-000000-aaaaaa-new");
  std::ofstream(sessions_ / "20260101-000000-aaaaaa-new" / "session.json")
      << R"({"format":99,"name":"new"})";
  start();

  const HttpReply reply = ask("GET", "/v1/sessions/20260101-000000-aaaaaa-new");

  EXPECT_EQ(reply.status, 400);
  EXPECT_THAT(reply.json()["detail"], HasSubstr("written by a newer version"));
}

TEST_F(Opalined, RefusesASecondDaemonOnTheSameSessions) {
  start();
  const auto second = spawn("opalined",
                            {"--sessions",
                             sessions_.string(),
                             "--port",
                             "0",
                             "--socket",
                             (root_.path() / "other.sock").string()},
                            "second.out");
  EXPECT_EQ(second->wait(), 4);
}

TEST_F(Opalined, RebuildsADamagedCatalogue) {
  start();
  const std::string id = create();
  ASSERT_TRUE(becomes(id, "succeeded"));
  daemon_->kill(SIGTERM);
  daemon_->wait();
  std::ofstream(sessions_ / ".catalogue.sqlite") << "this is no database, but long enough to look";

  start();

  const nlohmann::json sessions = ask("GET", "/v1/sessions").json()["sessions"];
  ASSERT_EQ(sessions.size(), 1U);
  EXPECT_EQ(sessions[0]["id"], id);
  EXPECT_EQ(sessions[0]["state"], "succeeded");
}

}  // namespace
}  // namespace opaline::testing
