// The command line, against a real daemon and without one.

#include <gmock/gmock.h>

#include "tests/api/opalined_fixture.h"

namespace opaline::testing {
namespace {

using ::testing::HasSubstr;

class Opaline : public OpalinedTest {
 protected:
  std::unique_ptr<Process> run_local() const {
    return spawn("opaline",
                 {"run",
                  "--local",
                  "--sessions",
                  sessions_.string(),
                  "--programs",
                  fakes(),
                  demo().string()},
                 "opaline.out");
  }
};

TEST_F(Opaline, RunsASessionThroughTheDaemonAndShowsItsProgress) {
  start();
  turn_on("capture.hold");
  const auto run = spawn("opaline", {"run", demo().string(), "--name", "Blue wax"}, "opaline.out");
  EXPECT_TRUE(eventually([&] { return run->output().find("50 %") != std::string::npos; }));
  turn_off("capture.hold");

  EXPECT_EQ(run->wait(), 0) << run->output();
  EXPECT_THAT(run->output(), HasSubstr("capture: holding  turn"));
  EXPECT_THAT(run->output(), HasSubstr("0:02 left"));
  EXPECT_THAT(run->output(), HasSubstr("preview: succeeded"));
  EXPECT_THAT(run->output(), HasSubstr("-blue-wax"));
  EXPECT_THAT(run->output(), HasSubstr("session  " + sessions_.string()));
}

TEST_F(Opaline, CancelsTheSessionOnCtrlC) {
  start();
  turn_on("capture.hold");
  const auto run = spawn("opaline", {"run", demo().string()}, "opaline.out");
  ASSERT_TRUE(eventually([&] { return run->output().find("holding") != std::string::npos; }));

  run->kill(SIGINT);

  EXPECT_EQ(run->wait(), 3) << run->output();
}

TEST_F(Opaline, FollowsASessionOverTheDeathOfItsDaemon) {
  start();
  turn_on("capture.hold");
  const auto run = spawn("opaline", {"run", demo().string()}, "opaline.out");
  ASSERT_TRUE(eventually([&] { return run->output().find("holding") != std::string::npos; }));

  daemon_->kill(SIGKILL);
  daemon_->wait();
  start();
  turn_off("capture.hold");

  EXPECT_EQ(run->wait(), 0) << run->output();
}

TEST_F(Opaline, TellsWhyASessionFailed) {
  start();
  turn_on("reconstruct.fail", "no memory");
  const auto run = spawn("opaline", {"run", demo().string()}, "opaline.out");

  EXPECT_EQ(run->wait(), 1);
  EXPECT_THAT(run->output(), HasSubstr("reconstruct: failed (no memory)"));
}

TEST_F(Opaline, RunsWithoutADaemon) {
  const auto run = run_local();

  EXPECT_EQ(run->wait(), 0) << run->output();
  EXPECT_THAT(run->output(), HasSubstr("preview: succeeded"));
}

TEST_F(Opaline, CancelsWithoutADaemon) {
  turn_on("capture.hold");
  const auto run = run_local();
  ASSERT_TRUE(eventually([&] { return run->output().find("holding") != std::string::npos; }));

  run->kill(SIGINT);

  EXPECT_EQ(run->wait(), 3) << run->output();
}

TEST_F(Opaline, SaysWhatToDoWhenThereIsNoDaemon) {
  const auto status = spawn("opaline", {"status"}, "opaline.out");

  EXPECT_EQ(status->wait(), 1);
  EXPECT_THAT(status->output(), HasSubstr("start one with \"opalined\""));
  EXPECT_THAT(status->output(), HasSubstr("--local"));
}

TEST_F(Opaline, ListsWatchesAndCancels) {
  start();
  turn_on("capture.hold");
  const std::string id = create();
  ASSERT_TRUE(becomes(id, "running"));
  const auto status = spawn("opaline", {"status"}, "status.out");
  EXPECT_EQ(status->wait(), 0);
  EXPECT_THAT(status->output(), HasSubstr(id + "  running"));
  const auto watch = spawn("opaline", {"watch", id}, "watch.out");

  EXPECT_EQ(spawn("opaline", {"cancel", id}, "cancel.out")->wait(), 0);

  EXPECT_EQ(watch->wait(), 3);
  EXPECT_EQ(spawn("opaline", {"watch", "nothing"}, "watch.out")->wait(), 2);
}

TEST_F(Opaline, ChecksFilesAndNamesEveryProblem) {
  const auto bad = root_.path() / "bad.toml";
  std::ofstream(bad) << "nmae = \"x\"\nrig = \"missing.toml\"\n";
  const auto check = spawn("opaline", {"check", demo().string(), bad.string()}, "check.out");

  EXPECT_EQ(check->wait(), 2);
  EXPECT_THAT(check->output(), HasSubstr("sim.toml: no problems"));
  EXPECT_THAT(check->output(), HasSubstr("bad.toml:1:1"));
  EXPECT_THAT(check->output(), HasSubstr("missing.toml"));
}

}  // namespace
}  // namespace opaline::testing
