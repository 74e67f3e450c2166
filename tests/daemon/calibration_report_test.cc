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
  const std::string page = calibration_page(a_record(2, 64.0), std::nullopt, {});
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
  const std::string page = calibration_page(a_record(3, 65.28), a_record(2, 64.0), {});
  EXPECT_THAT(page, AllOf(HasSubstr("+2 %"), HasSubstr("version 2"), HasSubstr("65.28")));
}

TEST(CalibrationReport, ShowsThePatchesOfAChart) {
  Record record = a_record(1, 64.0);
  const nlohmann::json patches = {{{"patch", "red"}, {"de2000", 0.7}},
                                  {{"patch", "blue"}, {"de2000", 1.1}}};
  record.steps.push_back({"colour", "", {}, {{"matrix", {{"patches", patches}}}}});
  EXPECT_THAT(calibration_page(record, std::nullopt, {}), HasSubstr("Patches of the chart"));
}

TEST(CalibrationReport, IsAPageForACalibrationThatHasBarelyBegun) {
  EXPECT_THAT(calibration_page(Record{}, std::nullopt, {}), HasSubstr("no older calibration"));
}

}  // namespace
}  // namespace opaline::daemon
