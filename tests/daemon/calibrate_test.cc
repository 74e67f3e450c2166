// opaline calibrate, opaline calibration, and a session that uses what they made, as an operator calls them.

#include <gmock/gmock.h>

#include <csignal>
#include <filesystem>

#include "base/event_log.h"
#include "base/files.h"
#include "base/session_directory.h"
#include "base/unix_socket.h"
#include "calibration/store.h"
#include "config/session_config.h"
#include "tests/support/named_directory.h"
#include "tests/support/process.h"
#include "tests/support/raw_http.h"
#include "tests/support/temporary_directory.h"

namespace opaline::daemon {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

class CalibrateProgram : public ::testing::Test {
 protected:
  void SetUp() override {
    run_ = directory_.path() / "run";
    fs::create_directories(run_);
    fs::permissions(run_, fs::perms::owner_all);
    // The demo's station with a quarter of the pixels, and a session of few lights.
    write("sim-rig.toml", "../sim/data", source() / "sim" / "data");
    std::string rig = read_text(directory_.path() / "sim-rig.toml").value();
    rig +=
        "\n[sim.camera]\nwidth = 128\nheight = 128\nfx = 1250.0\nfy = 1250.0\ncx = 64.0\ncy = "
        "64.0\n";
    ASSERT_TRUE(write_whole(system_files(), directory_.path() / "sim-rig.toml", rig));
    write("sim.toml", "regions = 4\nheld_out_lights = 8", "regions = 2\nheld_out_lights = 1");
  }
  void TearDown() override {
    if (fs::exists(socket())) call("opaline-rig", {"stop", socket()});
  }
  struct Said {
    int status = 0;
    std::string text;
  };
  std::unique_ptr<testing::Process> start(const char* program, std::vector<std::string> words) {
    words.insert(words.begin(),
                 (opaline::testing::named_directory("OPALINE_BIN_DIR") / program).string());
    return std::make_unique<testing::Process>(
        words,
        testing::Process::Environment{{"OPALINE_CALIBRATIONS", calibrations().string()},
                                      {"XDG_RUNTIME_DIR", run_.string()},
                                      {"OPALINE_LOCK_DIR", run_.string()}},
        directory_.path() / "out");
  }
  Said call(const char* program, const std::vector<std::string>& words) {
    const auto process = start(program, words);
    const int status = process->wait();
    return {status, process->output()};
  }
  Said calibrate(std::vector<std::string> options = {}) {
    options.insert(options.begin(), "calibrate");
    options.push_back(config("sim-rig.toml"));
    return call("opaline", options);
  }
  void fault(const std::vector<std::string>& words) {
    std::vector<std::string> all{"fault", socket()};
    all.insert(all.end(), words.begin(), words.end());
    ASSERT_EQ(call("opaline-rig", all).status, 0);
  }
  SessionDirectory session(const char* name) {
    const auto contents = config::read_contents(config("sim.toml"));
    EXPECT_TRUE(contents);
    return *SessionDirectory::create(system_files(), directory_.path() / name, *contents);
  }
  static std::string messages_of(const SessionDirectory& session) {
    std::string text;
    const auto log = read_events(session.events());
    if (!log) return log.error().message;
    for (const Event& event : log->events)
      text += event.type + ": " + event.data.value("message", "") + "\n";
    return text;
  }
  std::string config(const char* name) const { return (directory_.path() / name).string(); }
  static fs::path source() { return opaline::testing::named_directory("OPALINE_SOURCE_DIR"); }
  void write(const char* name, const std::string& was, const std::string& is) {
    std::string text = read_text(source() / "config" / name).value();
    const auto found = text.find(was);
    ASSERT_NE(found, std::string::npos);
    text.replace(found, was.size(), is);
    ASSERT_TRUE(write_whole(system_files(), directory_.path() / name, text));
  }
  fs::path calibrations() const { return directory_.path() / "calibrations"; }
  std::string socket() const { return (run_ / "opaline" / "rig-demo.sock").string(); }

  testing::TemporaryDirectory directory_;
  fs::path run_;
};

TEST_F(CalibrateProgram, CalibratesRefusesResumesAndRollsBack) {
  const Said first = calibrate();
  ASSERT_EQ(first.status, 0) << first.text;
  EXPECT_THAT(first.text, HasSubstr("calibration 1 is accepted and active"));
  fault({"gamma_on", "--count", "1000000"});
  const Said refused = calibrate();
  EXPECT_EQ(refused.status, 1);
  EXPECT_THAT(refused.text,
              AllOf(HasSubstr("linearity: projector gamma"), HasSubstr("calibrate --resume")));
  EXPECT_THAT(call("opaline", {"calibration", "activate", "2"}).text,
              HasSubstr("refused, not accepted"));
  EXPECT_THAT(call("opaline", {"calibration", "list"}).text, HasSubstr("*        1  accepted"));
  fault({"--clear"});
  const Said resumed = calibrate({"--resume"});
  EXPECT_EQ(resumed.status, 0) << resumed.text;
  EXPECT_THAT(
      resumed.text,
      AllOf(HasSubstr("calibration 2 is accepted"), Not(HasSubstr("black_level accepted"))));
  EXPECT_THAT(call("opaline", {"calibration", "rollback"}).text,
              HasSubstr("calibration 2 is left, calibration 1 is active"));
  EXPECT_THAT(call("opaline", {"calibration", "list"}).text, HasSubstr("*        1  accepted"));
  EXPECT_THAT(call("opaline", {"calibration", "rollback"}).text,
              HasSubstr("nothing to go back to"));
  EXPECT_EQ(call("opaline", {"calibration", "activate", "2"}).status, 0);
  EXPECT_THAT(call("opaline", {"calibration", "show", "2"}).text,
              HasSubstr("gain_electrons_per_code = [2."));
  EXPECT_THAT(call("opaline", {"calibration", "diff", "1", "2"}).text, HasSubstr("version 2"));
}

TEST_F(CalibrateProgram, ASessionUsesTheActiveOneAndRefusesAStationThatContradictsIt) {
  ASSERT_EQ(calibrate().status, 0);
  const SessionDirectory good = session("good");
  const Said captured = call("opaline-capture", {good.path().string()});
  ASSERT_EQ(captured.status, 0) << captured.text;
  EXPECT_THAT(messages_of(good), HasSubstr("calibration.used: calibration 1 of "));
  const auto own = read_text(good.calibration());
  ASSERT_TRUE(own);
  EXPECT_EQ(*own, read_text(calibrations() / "demo" / "0001" / "calibration.json").value());

  fault({"gamma_on", "--count", "1000000"});
  const SessionDirectory bad = session("bad");
  EXPECT_EQ(call("opaline-capture", {bad.path().string()}).status, 2);
  EXPECT_THAT(messages_of(bad),
              AllOf(HasSubstr("contradicts its active calibration 1: projector gamma"),
                    HasSubstr("opaline calibrate")));
}

TEST_F(CalibrateProgram, LeavesWhatItHasWhenItIsInterruptedAndGoesOnFromThere) {
  const auto run = start("opaline", {"calibrate", config("sim-rig.toml")});
  ASSERT_TRUE(testing::eventually(
      [&] { return run->output().find("black_level accepted") != std::string::npos; }));
  run->kill(SIGINT);
  EXPECT_EQ(run->wait(), 3) << run->output();
  const auto kept = calibration::Store(system_files(), calibrations(), "demo").read(1);
  ASSERT_TRUE(kept) << kept.error().message;
  EXPECT_EQ(kept->state(), calibration::RecordState::kIncomplete);
  const Said resumed = calibrate({"--resume"});
  EXPECT_EQ(resumed.status, 0) << resumed.text;
  EXPECT_THAT(resumed.text, Not(HasSubstr("black_level accepted")));
}

TEST_F(CalibrateProgram, AViewfinderIsServedOverHttpUntilItIsToldToEnd) {
  const fs::path door = run_ / "opalined.sock";
  const auto daemon = start(
      "opalined",
      {"--sessions", (run_ / "sessions").string(), "--listen", "", "--socket", door.string()});
  ASSERT_TRUE(testing::eventually([&] { return fs::exists(door); })) << daemon->output();
  const auto ask = [&](const char* method, const char* target, const std::string& body = "") {
    const auto connection = connect_unix(door);
    if (!connection) return testing::HttpReply();
    return testing::parse_reply(
        testing::converse(*connection, testing::request_text(method, target, body)));
  };
  const auto state = [&] {
    const auto view = ask("GET", "/v1/viewfinders/demo").json();
    return view.is_object() ? view.value("state", "") : "";
  };
  const std::string rig =
      nlohmann::json{{"rig", read_text(directory_.path() / "sim-rig.toml").value()}}.dump();
  ASSERT_EQ(ask("POST", "/v1/viewfinders", rig).status, 202);
  ASSERT_TRUE(testing::eventually([&] { return state() == "running"; }))
      << ask("GET", "/v1/viewfinders/demo").body;

  EXPECT_THAT(ask("GET", "/v1/viewfinders/demo/picture").body, HasSubstr("PNG"));
  EXPECT_GT(ask("GET", "/v1/viewfinders/demo").json().value("coverage", 0.0), 0.1);
  EXPECT_THAT(ask("POST", "/v1/viewfinders", rig).body, HasSubstr("in use by a viewfinder"));
  const Said refused = calibrate();
  EXPECT_EQ(refused.status, 4) << refused.text;
  EXPECT_THAT(refused.text, HasSubstr("calibration or viewfinder"));

  EXPECT_EQ(ask("DELETE", "/v1/viewfinders/demo").status, 202);
  EXPECT_TRUE(testing::eventually([&] { return state() == "over"; }))
      << ask("GET", "/v1/viewfinders/demo").body;
}

}  // namespace
}  // namespace opaline::daemon
