// The command line, against a real daemon and without one.

#include <gmock/gmock.h>
#include <poll.h>
#include <sys/socket.h>

#include <thread>

#include "tests/api/opalined_fixture.h"

namespace opaline::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

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

TEST_F(Opaline, LeavesTheSessionThatItWatchesOnCtrlC) {
  start();
  turn_on("capture.hold");
  const std::string id = create();
  const auto watch = spawn("opaline", {"watch", id}, "watch.out");
  ASSERT_TRUE(eventually([&] { return watch->output().find("holding") != std::string::npos; }));

  watch->kill(SIGINT);

  EXPECT_EQ(watch->wait(), 5) << watch->output();
  EXPECT_THAT(watch->output(), HasSubstr("opaline cancel " + id));
  EXPECT_EQ(state_of(id), "running");
}

TEST_F(Opaline, TellsWhatTheDaemonCannotReadOfASession) {
  start();
  const std::string id = create();
  ASSERT_TRUE(becomes(id, "succeeded"));
  {
    std::fstream log(sessions_ / id / "events.jsonl");
    log.seekp(2);
    log << "xxxx";
  }
  const auto watch = spawn("opaline", {"watch", id}, "watch.out");

  EXPECT_EQ(watch->wait(), 1);
  EXPECT_THAT(watch->output(), HasSubstr("events.jsonl"));
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

TEST_F(Opaline, NamesTheDirectoryFirstAndResumesItWithoutADaemon) {
  turn_on("reconstruct.fail", "no memory");
  const auto run = run_local();
  ASSERT_EQ(run->wait(), 1) << run->output();
  const std::string output = run->output();
  ASSERT_TRUE(output.starts_with("session  " + sessions_.string() + "/")) << output;
  const std::string directory = output.substr(9, output.find('\n') - 9);
  turn_off("reconstruct.fail");

  const auto resumed =
      spawn("opaline", {"resume", "--local", "--programs", fakes(), directory}, "resumed.out");

  EXPECT_EQ(resumed->wait(), 0) << resumed->output();
  EXPECT_THAT(resumed->output(), HasSubstr("preview: succeeded"));
  EXPECT_THAT(resumed->output(), Not(HasSubstr("capture: started")));
}

TEST_F(Opaline, TriesAgainWhatFailsForAMomentWithoutADaemon) {
  turn_on("capture.hold");
  const auto run = run_local();
  ASSERT_TRUE(eventually([&] { return run->output().find("holding") != std::string::npos; }));
  const std::filesystem::path lock =
      run->output().substr(9, run->output().find('\n') - 9) + "/lock";
  std::filesystem::rename(lock, lock.string() + ".away");
  std::filesystem::create_symlink(lock, lock);  // leads nowhere
  EXPECT_TRUE(eventually([&] { return run->output().find("trying again") != std::string::npos; }))
      << run->output();
  std::filesystem::remove(lock);
  std::filesystem::rename(lock.string() + ".away", lock);
  turn_off("capture.hold");

  EXPECT_EQ(run->wait(), 0) << run->output();
}

TEST_F(Opaline, AsksADaemonOverTcpWithItsToken) {
  start({"--listen", "127.0.0.2", "--token-file", token_file()});
  const std::string url = "http://127.0.0.2:" + std::to_string(port());
  const auto status = [&](const std::vector<std::string>& more) {
    std::vector<std::string> arguments{"--url", url, "status"};
    arguments.insert(arguments.begin(), more.begin(), more.end());
    const auto process = spawn("opaline", arguments, "status.out");
    const int code = process->wait();
    return std::pair(code, process->output());
  };

  EXPECT_EQ(status({"--token", "0123456789abcdef"}).first, 0);
  EXPECT_EQ(status({"--token-file", token_file()}).first, 0);
  const auto [code, output] = status({"--token", "wrong"});
  EXPECT_EQ(code, 1);
  EXPECT_THAT(output, HasSubstr("expected the daemon's token"));
}

/// Something at the daemon's socket that is no daemon: gives everybody the same answer.
class Impostor {
 public:
  Impostor(const std::filesystem::path& socket, std::string body)
      : listener_(*listen_unix(socket)),
        reply_("HTTP/1.1 200 OK\r\nContent-Length: " + std::to_string(body.size()) +
               "\r\nConnection: close\r\n\r\n" + body),
        thread_([this](const std::stop_token& stop) {
          while (!stop.stop_requested()) answer_one();
        }) {}

 private:
  void answer_one() const {
    pollfd ready{listener_.get(), POLLIN, 0};
    if (::poll(&ready, 1, 10) <= 0) return;
    const FileDescriptor peer(::accept(listener_.get(), nullptr, nullptr));
    char request[65536];
    if (::recv(peer.get(), request, sizeof request, 0) > 0) {
      ::send(peer.get(), reply_.data(), reply_.size(), MSG_NOSIGNAL);
    }
    while (::recv(peer.get(), request, sizeof request, 0) > 0) {
    }
  }

  FileDescriptor listener_;
  std::string reply_;
  std::jthread thread_;
};

TEST_F(Opaline, SaysClearlyThatAnAnswerIsNoDaemons) {
  for (const char* body : {"7", "[]", "{}", R"({"id":7})", R"({"active":3,"sessions":"x"})"}) {
    const Impostor impostor(socket_, body);
    const auto run = spawn("opaline", {"run", demo().string()}, "run.out");
    EXPECT_EQ(run->wait(), 1) << body;
    EXPECT_THAT(run->output(), HasSubstr("the daemon's answer")) << body;
    EXPECT_LE(spawn("opaline", {"status"}, "status.out")->wait(), 1) << body;
  }
}

TEST_F(Opaline, GivesAnExampleForEverySubcommand) {
  for (const char* command : {"run", "check", "status", "watch", "cancel", "resume"}) {
    const auto help = spawn("opaline", {command, "--help"}, "help.out");
    EXPECT_EQ(help->wait(), 0);
    EXPECT_THAT(help->output(), HasSubstr("Example")) << command;
  }
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
