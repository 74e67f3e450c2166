// A session whose sample lies in a holder, as opaline-capture takes it: the rig file has the camera 1.5 mm and half a degree from where it stands.

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <numbers>

#include "base/event_log.h"
#include "base/files.h"
#include "base/io/dataset_io.h"
#include "base/session_directory.h"
#include "calibration/pose_chain.h"
#include "calibration/record.h"
#include "config/session_config.h"
#include "daemon/session_camera.h"
#include "sim/optics.h"
#include "tests/support/named_directory.h"
#include "tests/support/process.h"
#include "tests/support/temporary_directory.h"

namespace opaline::daemon {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

/// By ruler and protractor.
std::string believed_camera() {
  const double angle = 0.5 * std::numbers::pi / 180.0;
  const Pose turn{
      {std::cos(angle), 0, std::sin(angle), 0, 1, 0, -std::sin(angle), 0, std::cos(angle)}, {}};
  const Pose truth = sim::demo_camera_model().camera_from_sample;
  std::array<double, 9> r{};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      for (std::size_t k = 0; k < 3; ++k)
        r[3 * i + j] += truth.rotation[3 * i + k] * turn.rotation[3 * k + j];
    }
  }
  const Vec3 t = truth.translation + Vec3{1.0, -1.0, 0.5};
  return fmt::format(
      "\n[calibration.camera]\nrotation = [{}, {}, {}, {}, {}, {}, {}, {}, {}]\n"
      "translation = [\"{} mm\", \"{} mm\", \"{} mm\"]\n",
      r[0],
      r[1],
      r[2],
      r[3],
      r[4],
      r[5],
      r[6],
      r[7],
      r[8],
      t.x,
      t.y,
      t.z);
}

class SessionPlacement : public ::testing::Test {
 protected:
  void SetUp() override { fs::create_directories(run_, none_); }
  void TearDown() override {
    for (const char* name : {"rig-holder.sock", "rig-beside.sock"}) {
      const fs::path socket = run_ / "opaline" / name;
      if (fs::exists(socket)) call("opaline-rig", {"stop", socket.string()});
    }
  }
  struct Said {
    int status = 0;
    std::string text;
  };
  Said call(const char* program, std::vector<std::string> words) {
    words.insert(words.begin(),
                 (opaline::testing::named_directory("OPALINE_BIN_DIR") / program).string());
    fs::permissions(run_, fs::perms::owner_all);
    testing::Process process(
        words,
        testing::Process::Environment{
            {"OPALINE_CALIBRATIONS", (directory_.path() / "calibrations").string()},
            {"XDG_RUNTIME_DIR", run_.string()},
            {"OPALINE_LOCK_DIR", run_.string()}},
        directory_.path() / "out");
    const int status = process.wait();
    return {status, process.output()};
  }
  static std::string replaced(std::string text, const std::string& was, const std::string& is) {
    const auto found = text.find(was);
    EXPECT_NE(found, std::string::npos) << was;
    return text.replace(found, was.size(), is);
  }
  static std::string text_of(const std::string& file) {
    const fs::path source = opaline::testing::named_directory("OPALINE_SOURCE_DIR");
    return read_text(source / "config" / file).value();
  }
  /// A session that has not begun, of a rig file and what that says in addition, with fewer lights.
  SessionDirectory made(const std::string& name,
                        const std::string& session_file,
                        const std::string& rig_file,
                        const std::string& calibration) {
    const fs::path source = opaline::testing::named_directory("OPALINE_SOURCE_DIR");
    const auto write = [&](const std::string& file, const std::string& contents) {
      EXPECT_TRUE(write_whole(system_files(), directory_.path() / file, contents));
    };
    write(rig_file,
          replaced(text_of(rig_file), "../sim/data", source / "sim" / "data") + calibration);
    std::string session = replaced(text_of(session_file), "regions = 4", "regions = 2");
    session = replaced(session, "held_out_lights = 8", "held_out_lights = 1");
    if (session.find("mode = \"planned\"") != std::string::npos)
      session = replaced(session, "mode = \"planned\"", "mode = \"bracket\"");
    write(session_file, session);
    const auto contents = config::read_contents(directory_.path() / session_file);
    EXPECT_TRUE(contents) << contents.error().message;
    return *SessionDirectory::create(system_files(), directory_.path() / name, *contents);
  }
  void capture(const SessionDirectory& session) {
    const Said said = call("opaline-capture", {session.path().string()});
    EXPECT_EQ(said.status, 0) << said.text;
  }
  /// Captured with what the rig file says in addition.
  SessionDirectory captured(const std::string& name, const std::string& calibration) {
    auto session = made(name, "sim_holder.toml", "sim-rig-holder.toml", calibration);
    capture(session);
    return session;
  }
  /// Relative RMS of one's radiance from another's where both tell.
  static double apart(const SessionDirectory& one, const SessionDirectory& other) {
    const auto a = read_dataset(one.path());
    const auto b = read_dataset(other.path());
    EXPECT_TRUE(a && b);
    double squares = 0.0;
    double size = 0.0;
    for (std::size_t i = 0; i < a->illuminations.size(); ++i) {
      const Illumination& p = a->illuminations[i];
      const Illumination& q = b->illuminations[i];
      for (std::size_t s = 0; s < p.radiance.samples().size(); ++s) {
        if (p.mask.samples()[s / 3] == 0 || q.mask.samples()[s / 3] == 0) continue;
        squares += std::pow(p.radiance.samples()[s] - q.radiance.samples()[s], 2);
        size += std::pow(q.radiance.samples()[s], 2);
      }
    }
    return std::sqrt(squares / size);
  }
  /// The same of the light that their rasters say fell on the sample.
  static double lit_apart(const SessionDirectory& one, const SessionDirectory& other) {
    const auto a = read_dataset(one.path());
    const auto b = read_dataset(other.path());
    EXPECT_TRUE(a && b);
    double squares = 0.0;
    double size = 0.0;
    for (std::size_t i = 0; i < a->illuminations.size(); ++i) {
      const auto p = a->illuminations[i].irradiance.samples();
      const auto q = b->illuminations[i].irradiance.samples();
      for (std::size_t s = 0; s < p.size(); ++s) {
        squares += std::pow(p[s] - q[s], 2);
        size += std::pow(q[s], 2);
      }
    }
    return std::sqrt(squares / size);
  }
  static std::string messages_of(const SessionDirectory& session) {
    std::string text;
    const auto log = read_events(session.events());
    if (!log) return log.error().message;
    for (const Event& event : log->events)
      text += event.type + ": " + event.data.value("message", "") + "\n";
    return text;
  }

  testing::TemporaryDirectory directory_;
  std::error_code none_;
  fs::path run_ = directory_.path() / "run";
};

// The same frames reach the cells by one pose or another, so noise drops out of the comparison. Half a percent is the goal for the relighting error.
TEST_F(SessionPlacement, TheHolderTellsWhichPixelSeesWhichCellWhateverTheRigFileBelieves) {
  const auto truth = captured("truth", "\n[calibration]\nuse = \"given\"\n");
  const auto believed =
      captured("believed", "\n[calibration]\nuse = \"given\"\n" + believed_camera());
  const auto placed = captured("placed", believed_camera());
  EXPECT_THAT(messages_of(placed), HasSubstr("placement.measured: the sample's place by "));
  EXPECT_TRUE(fs::exists(placed.path() / "calibration" / "placement.json"));
  EXPECT_FALSE(fs::exists(believed.path() / "calibration" / "placement.json"));
  // Whoever draws what the camera saw draws it from there, too. A tenth of a pixel is the for a camera.
  const CameraModel camera = session_camera(placed, {}).value();
  CameraModel should = sim::demo_camera_model();
  should.width = should.height = 400;
  should.cx = should.cy = 200.0;
  for (const Vec3 corner : {Vec3{0, 0, 6}, Vec3{24, 0, 6}, Vec3{0, 24, 6}, Vec3{24, 24, 6}}) {
    EXPECT_NEAR(camera.project(corner).x, should.project(corner).x, 0.1);
    EXPECT_NEAR(camera.project(corner).y, should.project(corner).y, 0.1);
  }
  EXPECT_EQ(session_camera(truth, camera).value(), camera);  // none of its own
  EXPECT_GT(apart(believed, truth), 0.05);
  EXPECT_LT(apart(placed, truth), 0.005);
  RecordProperty("believed", fmt::format("{}", apart(believed, truth)));
  RecordProperty("placed", fmt::format("{}", apart(placed, truth)));
}

/// What a perfect calibration would have found.
calibration::Record measured(const capture::StationCalibration& truth) {
  calibration::Record record;
  record.version = 1;
  calibration::Measured& m = record.measured;
  m.black_level = truth.camera.black_level;
  m.clipping_code = truth.camera.max_code();
  m.gain_electrons_per_code = truth.camera.gain_electrons_per_code;
  m.read_noise_electrons = truth.camera.read_noise_electrons;
  m.projector_gamma = truth.projector.gamma;
  m.projector_black = truth.projector.black_level;
  m.camera_vignetting = truth.camera.vignetting;
  m.projector_vignetting = truth.projector.vignetting;
  m.camera_lens = calibration::MeasuredLens{truth.camera.model, {}};
  m.camera_lens->model.camera_from_sample = {};
  m.projector_lens = calibration::MeasuredLens{truth.projector.lens, {}};
  m.projector_lens->model.camera_from_sample = calibration::chained(
      truth.projector.lens.camera_from_sample, truth.camera.model.camera_from_sample.inverse());
  return record;
}

// The same station by its truth, and by a rig file that is wrong in camera and projector: calibrated, and calibrated but for the projector, which then lights
// places up to 3 mm from where it is thought to. Pixels are 0.09 mm, and whole ones: whose picture is drawn by another lens has other pixels at a
// region's edge, a few tenths of them on average, 0.2 % of a region's 12 mm.
TEST_F(SessionPlacement, TheProjectorLightsTheSampleFromWhereBoardsAndHolderHaveIt) {
  const auto truth =
      made("truth", "sim_beside.toml", "sim-rig-beside.toml", "\n[calibration]\nuse = \"given\"\n");
  capture(truth);
  const auto config = config::load_resolved(truth);
  ASSERT_TRUE(config) << config.error().message;
  calibration::Record record = measured(config->rig.calibration);
  const auto calibrated = [&](const char* name) {
    const auto session = made(name, "sim_beside_believed.toml", "sim-rig-beside-believed.toml", "");
    EXPECT_TRUE(system_files().make_directories(session.calibration().parent_path()));
    EXPECT_TRUE(write_whole(system_files(), session.calibration(), to_text(record)));
    capture(session);
    return session;
  };
  const auto placed = calibrated("placed");
  EXPECT_THAT(messages_of(placed), HasSubstr("placement.measured: the sample's place by "));
  record.measured.projector_lens.reset();
  const auto believed = calibrated("believed");
  EXPECT_LT(apart(placed, truth), 0.005);
  EXPECT_LT(lit_apart(placed, truth), 0.01);
  EXPECT_GT(apart(believed, truth), 0.1);
  for (const auto& [name, session] : {std::pair{"placed", &placed}, {"believed", &believed}}) {
    RecordProperty(fmt::format("{}_seen", name), fmt::format("{}", apart(*session, truth)));
    RecordProperty(fmt::format("{}_lit", name), fmt::format("{}", lit_apart(*session, truth)));
  }
}

}  // namespace
}  // namespace opaline::daemon
