#include "daemon/calibrate/calibration_report.h"

#include <gmock/gmock.h>

namespace opaline::daemon {
namespace {

using calibration::Record;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

Record a_record(int version, double black) {
  Record record;
  record.version = version;
  record.station = "demo <1>";
  record.camera = {"sim", "1", 128, 128, 12};
  record.measured.black_level = black;
  record.measured.gain_electrons_per_code = 2.5;
  record.measured.read_noise_electrons = 3.0;
  record.measured.response = capture::ResponseCurve{};
  record.steps.push_back({"black_level",
                          "2026-01-01T00:00:00Z",
                          {{"hot pixels", 0.002, 0.01, "of all pixels", "cool the camera"}},
                          {{"dark_map", {{0.1, 0.2}, {0.3, 0.4}}}}});
  record.steps.push_back({"linearity", "", {}, {{"curve", {0.0, 0.26, 0.5, 0.74, 1.0}}}});
  record.steps.push_back(
      {"radiometric",
       "",
       {{"exposure times", 0.02, 0.01, "relative", "set the shutter to manual"}},
       {{"photon_transfer", {{{100.0, 41.0}, {1000.0, 401.0}}, {{500.0, 201.0}}, {{900.0, 361.0}}}},
        {"exposures",
         {{{"reported_s", 0.1}, {"measured_s", 0.1}},
          {{"reported_s", 1.0}, {"measured_s", 1.02}}}}}});
  return record;
}

// Six plots and no complaint: gates, dark map, response twice, noise, exposures.
TEST(CalibrationReport, DrawsWhatTheStepsMeasured) {
  const std::string page = calibration_page(a_record(2, 64.0), std::nullopt, {}, {});
  std::size_t drawings = 0;
  for (std::size_t at = page.find("<svg"); at != std::string::npos; at = page.find("<svg", at + 1))
    ++drawings;
  EXPECT_EQ(drawings, 6u) << page.substr(0, 2000);
  EXPECT_THAT(page,
              AllOf(HasSubstr("hot pixels"), HasSubstr("refused: set the shutter to manual")));
  EXPECT_THAT(page, AllOf(HasSubstr("demo &lt;1&gt;"), Not(HasSubstr("demo <1>"))));
  EXPECT_THAT(page, Not(HasSubstr("Patches of the chart")));
}

TEST(CalibrationReport, SaysHowFarItHasDriftedSinceTheLastOne) {
  const std::string page = calibration_page(a_record(3, 65.28), a_record(2, 64.0), {}, {});
  EXPECT_THAT(page, AllOf(HasSubstr("+2 %"), HasSubstr("version 2"), HasSubstr("65.28")));
}

TEST(CalibrationReport, ShowsThePatchesOfAChart) {
  Record record = a_record(1, 64.0);
  const nlohmann::json patches = {{{"patch", "red"}, {"de2000", 0.7}},
                                  {{"patch", "blue"}, {"de2000", 1.1}}};
  record.steps.push_back({"colour", "", {}, {{"matrix", {{"patches", patches}}}}});
  EXPECT_THAT(calibration_page(record, std::nullopt, {}, {}), HasSubstr("Patches of the chart"));
}

Record with_lenses(int version, double fx) {
  Record record = a_record(version, 64.0);
  record.projector = {"sim", "2", 64, 48, 0};
  CameraModel lens;
  lens.fx = fx;
  record.measured.camera_lens = calibration::MeasuredLens{lens, {0.4}};
  record.measured.projector_lens = calibration::MeasuredLens{CameraModel{}, {}};
  nlohmann::json corners = nlohmann::json::array();
  for (int i = 0; i < 12; ++i)
    corners.push_back({10.0 * i, 8.0 * i, 0.03 * (i % 3 - 1), -0.02 * (i % 2)});
  record.steps.push_back(
      {"geometry",
       "",
       {},
       {{"poses",
         {{{"name", "pose 1"},
           {"corners", 12},
           {"right_deg", 20.0},
           {"down_deg", 3.0},
           {"left_out", ""}},
          {{"name", "pose 2"},
           {"corners", 12},
           {"right_deg", -5.0},
           {"down_deg", 25.0},
           {"left_out", ""}},
          {{"name", "pose 3"}, {"corners", 0}, {"left_out", "no board <found>"}}}},
        {"residuals",
         {{{"name", "pose 1"}, {"camera", corners}, {"projector", corners}},
          {{"name", "pose 2"}, {"camera", corners}, {"projector", corners}}}}}});
  return record;
}

// Residuals of both lenses, of each pose, their histogram, coverage, tilts and bars: six more drawings.
TEST(CalibrationReport, DrawsWhatIsLeftOfTheLenses) {
  const std::string page = calibration_page(with_lenses(2, 881.0), with_lenses(1, 880.0), {}, {});
  const std::string section = page.substr(page.find("id=\"geometry\""));
  const std::string figure = "<figure class=\"plot\">";
  std::size_t drawings = 0;
  for (std::size_t at = section.find(figure); at != std::string::npos;
       at = section.find(figure, at + 1))
    ++drawings;
  EXPECT_EQ(drawings, 6u);
  EXPECT_THAT(section,
              AllOf(HasSubstr("left out: no board &lt;found&gt;"), HasSubstr("pose 1: 0.0")));
  EXPECT_THAT(section, AllOf(HasSubstr("since version 1"), HasSubstr("<td>+1</td><td>+1.8</td>")))
      << "1 px in deviations of 0.4 px each";
}

TEST(CalibrationReport, OutlivesResidualsThatAreNone) {
  Record record = with_lenses(1, 880.0);
  record.steps.back().values["residuals"] = {{{"name", "pose 1"}, {"camera", {{1, 2}, "x"}}}};
  record.steps.back().values["poses"] = "none";
  EXPECT_THAT(calibration_page(record, std::nullopt, {}, {}), HasSubstr("id=\"geometry\""));
}

TEST(CalibrationReport, ShowsPatchesAsPublishedAndAsSeen) {
  Record record = a_record(1, 64.0);
  record.steps.push_back(
      {"colour",
       "",
       {},
       {{"patches",
         {{{"patch", "white"}, {"lab", {100.0, 0.0, 0.0}}, {"seen_lab", {100.0, 0.0, 0.0}}},
          {{"patch", "grey"}, {"lab", {53.585, 0.0, 0.0}}, {"seen_lab", {50.0, 0.0, 0.0}}}}}}});
  const std::string page = calibration_page(record, std::nullopt, {}, {});
  EXPECT_THAT(page, HasSubstr("fill=\"#ffffff\"")) << "D50 white is a screen's white";
  EXPECT_THAT(page, HasSubstr("fill=\"#808080\"")) << "L* = 53.585 is sRGB's half";
  EXPECT_THAT(page, HasSubstr(">0.00</text>"));
}

TEST(CalibrationReport, IsAPageForACalibrationThatHasBarelyBegun) {
  EXPECT_THAT(calibration_page(Record{}, std::nullopt, {}, {}), HasSubstr("no older calibration"));
}

}  // namespace
}  // namespace opaline::daemon
