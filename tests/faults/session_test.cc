// The real programs from a configuration to a report, on the tiny session, the daemon killed on the way.

#include <gmock/gmock.h>

#include <algorithm>
#include <csignal>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "base/event_log.h"
#include "base/files.h"
#include "base/io/volume_io.h"
#include "base/session_directory.h"
#include "bench/faults/fault_bed.h"
#include "tests/support/named_directory.h"
#include "tests/support/process.h"

namespace opaline::faults {
namespace {

using testing::eventually;
using ::testing::HasSubstr;
using testing::Process;

std::filesystem::path programs() { return opaline::testing::named_directory("OPALINE_BIN_DIR"); }

class WholeSession : public ::testing::Test {
 protected:
  void SetUp() override {
    auto made = FaultBed::create({programs()});
    ASSERT_TRUE(made) << made.error().message;
    bed_ = *std::move(made);
  }
  std::filesystem::path in_bed(const std::string& name) const { return bed_->root() / name; }

  std::unique_ptr<Process> spawn(std::vector<std::string> command,
                                 const std::string& output) const {
    command.front() = (programs() / command.front()).string();
    return std::make_unique<Process>(
        command,
        Process::Environment{{"OPALINE_SOCKET", in_bed("opalined.sock").string()}},
        in_bed(output));
  }
  void start_daemon() {
    daemon_ = spawn({"opalined", "--sessions", in_bed("sessions").string(), "--port", "0"},
                    "opalined.out");
    ASSERT_TRUE(eventually([&] { return says(*daemon_, "sessions in"); })) << daemon_->output();
  }
  static bool says(const Process& process, const std::string& what) {
    return process.output().find(what) != std::string::npos;
  }

  /// The one session that the daemon has; empty before.
  std::filesystem::path session() const {
    std::error_code none;
    for (const auto& entry : std::filesystem::directory_iterator(in_bed("sessions"), none)) {
      if (std::filesystem::exists(entry.path() / "session.json", none)) return entry.path();
    }
    return {};
  }
  std::ptrdiff_t count(const std::string& type) const {
    const auto log = read_events(session() / "events.jsonl");
    return log ? std::ranges::count(log->events, type, &Event::type) : 0;
  }

  std::unique_ptr<FaultBed> bed_;
  std::unique_ptr<Process> daemon_;
};

/// Numbers only: what is not finite becomes null in JSON, and what is missing too.
void expect_numbers(const nlohmann::json& json, const std::vector<std::string>& pointers) {
  for (const std::string& pointer : pointers) {
    const nlohmann::json::json_pointer place(pointer);
    EXPECT_TRUE(json.contains(place) && json[place].is_number()) << pointer;
  }
}

TEST_F(WholeSession, GoesFromAConfigurationToItsReportThoughTheDaemonIsKilled) {
  start_daemon();
  const auto run = spawn({"opaline", "run", in_bed("session.toml").string()}, "opaline.out");
  ASSERT_TRUE(eventually([&] { return count("region.captured") > 0; })) << run->output();

  daemon_->kill(SIGKILL);
  daemon_->wait();
  start_daemon();

  EXPECT_EQ(run->wait(), 0) << run->output() << daemon_->output();
  EXPECT_EQ(count("region.captured"), 6);  // the capture lived on
  EXPECT_THAT(run->output(), HasSubstr((session() / "report.html").string()));
  const auto page = read_text(session() / "report.html");
  ASSERT_TRUE(page) << page.error().message;
  EXPECT_THAT(*page, HasSubstr("</html>"));
  const auto text = read_text(session() / "results.json");
  ASSERT_TRUE(text) << text.error().message;
  const auto results = nlohmann::json::parse(*text, nullptr, false);
  expect_numbers(results,
                 {"/relighting_error",
                  "/relighting_noise_floor",
                  "/seconds",
                  "/relighting/lights/0/error",
                  "/relighting/lights/1/noise_floor",
                  "/fit/0/chi_squared_per_datum",
                  "/reconstruction/channels/2/chi_squared_per_datum"});
  EXPECT_EQ(results["relighting"]["lights"].size(), 2U);
  EXPECT_EQ(results["fit"].size(), 6U);
}

/// The tiny session's files with the projector on the camera's side.
void write_front_lit(const FaultBed& bed) {
  std::string session = read_text(bed.root() / "session.toml").value();
  const auto replace = [&](const std::string& from, const std::string& to) {
    session.replace(session.find(from), from.size(), to);
  };
  replace("rig.toml", "rig_front.toml");
  replace("[capture]", "lit_face = \"z_max\"\n[capture]");
  const std::string rig =
      read_text(bed.root() / "rig.toml").value() + "lit_face = \"z_max\"\n";  // of [sim.transport]
  ASSERT_TRUE(write_whole(system_files(), bed.root() / "front.toml", session));
  ASSERT_TRUE(write_whole(system_files(), bed.root() / "rig_front.toml", rig));
}

TEST_F(WholeSession, GoesFromAConfigurationToItsReportLitFromInFront) {
  write_front_lit(*bed_);
  const auto run = spawn({"opaline",
                          "run",
                          "--local",
                          "--sessions",
                          in_bed("sessions").string(),
                          in_bed("front.toml").string()},
                         "opaline.out");
  ASSERT_EQ(run->wait(), 0) << run->output();
  const auto text = read_text(session() / "results.json");
  ASSERT_TRUE(text) << text.error().message;
  const auto results = nlohmann::json::parse(*text, nullptr, false);
  expect_numbers(results,
                 {"/fit/0/chi_squared_per_datum", "/reconstruction/direct_light_margin_mm"});
  // 3 / sigma_t' of marble of 1.5 to 1.7 per mm with veins of half as much: 1.8 to 4 mm.
  const double margin = results["reconstruction"]["direct_light_margin_mm"];
  EXPECT_GT(margin, 1.5);
  EXPECT_LT(margin, 4.0);
}

/// A session on the tiny station, of which one light's second exposure is disturbed in so many takes.
class UnsteadySession : public WholeSession {
 protected:
  nlohmann::json results_with(const std::string& fault, int takes) {
    std::string config = read_text(in_bed("session.toml")).value();
    config.insert(config.find("[reconstruction]"), "[capture.exposures]\nmode = \"fixed\"\n");
    EXPECT_TRUE(write_whole(system_files(), in_bed("fixed.toml"), config));
    const auto rig = spawn({"opaline-rig",
                            "serve",
                            "--config",
                            in_bed("rig.toml").string(),
                            "--socket",
                            bed_->rig_socket().string()},
                           "rig.out");
    EXPECT_TRUE(eventually([&] { return says(*rig, "ready"); })) << rig->output();
    for (int take = 0; take < takes; ++take) {  // each of five exposures
      const auto armed = spawn({"opaline-rig",
                                "fault",
                                bed_->rig_socket().string(),
                                fault,
                                "--pattern",
                                "17",
                                "--skip",
                                take == 0 ? "1" : "4"},
                               "fault.out");
      EXPECT_EQ(armed->wait(), 0) << armed->output();
    }
    const auto run = spawn({"opaline",
                            "run",
                            "--local",
                            "--sessions",
                            in_bed("sessions").string(),
                            in_bed("fixed.toml").string()},
                           "opaline.out");
    EXPECT_EQ(run->wait(), 0) << run->output();
    output_ = run->output();
    const auto text = read_text(session() / "results.json");
    EXPECT_TRUE(text) << text.error().message;
    return text ? nlohmann::json::parse(*text, nullptr, false) : nlohmann::json();
  }
  std::string report() const { return read_text(session() / "report.html").value_or(""); }
  std::string output_;
};

TEST_F(UnsteadySession, NamesAShadowThatFellOnOneExposureAndTakesTheLightAgain) {
  const auto results = results_with("shadow", 1);
  EXPECT_EQ(count("region.unsteady"), 1);
  EXPECT_EQ(count("region.retaken"), 1);
  EXPECT_THAT(output_, HasSubstr("motion"));
  EXPECT_EQ(results["capture"]["unsteady"].size(), 1U);
  EXPECT_TRUE(results["capture"]["unusable"].empty());
  EXPECT_NE(report().find("Not steady: region_0_1: motion"), std::string::npos);
}

TEST_F(UnsteadySession, LeavesALightOutThatIsNeverSteadyAndSaysSo) {
  const auto results = results_with("shadow", 4);
  EXPECT_EQ(count("region.unsteady"), 4);
  EXPECT_EQ(count("region.unusable"), 1);
  EXPECT_EQ(results["capture"]["unusable"].size(), 1U);
  EXPECT_NE(report().find("Not usable: region_0_1: its exposures do not agree, 4 times"),
            std::string::npos);
}

TEST_F(WholeSession, LeavesAMaterialThatOtherProgramsRead) {
  const auto session = bed_->new_session();
  ASSERT_TRUE(session) << session.error().message;
  for (const char* job : {"opaline-capture", "opaline-reconstruct"}) {
    const auto done = bed_->complete(job, *session);
    ASSERT_TRUE(done) << done.error().message;
  }
  const auto path = *session / "material.vdb";
  const auto material = read_material(path);
  ASSERT_TRUE(material) << material.error().message;
  EXPECT_EQ(material->block.cell_count(), 8U * 8U * 4U);
  for (const ChannelCoefficients& channel : material->channels) {
    EXPECT_TRUE(std::ranges::all_of(channel.absorption, [](double a) { return a > 0.0; }));
    EXPECT_TRUE(std::ranges::all_of(channel.reduced_scattering, [](double s) { return s > 0.0; }));
  }
  Process print({"/usr/bin/vdb_print", path.string()}, {}, in_bed("vdb_print.out"));
  EXPECT_EQ(print.wait(), 0);
  for (const char* grid : {"absorption", "reduced_scattering", "diffusion"}) {
    EXPECT_THAT(print.output(), HasSubstr(grid));
  }
}

}  // namespace
}  // namespace opaline::faults
