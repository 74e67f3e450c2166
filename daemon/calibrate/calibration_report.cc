#include "daemon/calibrate/calibration_report.h"

#include <fmt/format.h>

#include <vector>

#include "daemon/calibrate/calibration_plots.h"
#include "daemon/calibrate/geometry_section.h"
#include "daemon/calibrate/patch_swatches.h"
#include "daemon/report/html.h"

namespace opaline::daemon {
namespace {

using calibration::Measured;
using calibration::Record;
using calibration::StepRecord;

using Rows = std::vector<std::vector<std::string>>;

std::string device_text(const calibration::DeviceIdentity& device) {
  return fmt::format("{} ({}), {} x {}", device.model, device.serial, device.width, device.height);
}

std::string summary(const Record& record) {
  return html::facts({{"Station", record.station},
                      {"Version", std::to_string(record.version)},
                      {"State", std::string(to_string(record.state()))},
                      {"Begun", record.created},
                      {"Program", record.program},
                      {"Camera", device_text(record.camera)},
                      {"Projector", device_text(record.projector)}});
}

std::string gates_of(const Record& record) {
  std::string body;
  for (const StepRecord& step : record.steps) {
    Rows rows;
    for (const calibration::Gate& gate : step.gates) {
      rows.push_back({gate.name,
                      gate.unit.empty() ? "" : fmt::format("{:.4g}", gate.value),
                      gate.unit.empty() ? "" : fmt::format("{:.4g}", gate.limit),
                      gate.unit,
                      gate.passed() ? "accepted" : fmt::format("refused: {}", gate.remedy)});
    }
    body += html::paragraph(fmt::format("{}, {}", step.step, step.finished));
    body += html::table({"gate", "figure", "at most", "of", "verdict"}, rows, true);
  }
  return body;
}

struct Quantity {
  const char* name;
  std::optional<double> Measured::*value;
  const char* unit;
};
constexpr Quantity kQuantities[] = {
    {"black level", &Measured::black_level, "codes"},
    {"clipping", &Measured::clipping_code, "code"},
    {"gain", &Measured::gain_electrons_per_code, "electrons a code"},
    {"read noise", &Measured::read_noise_electrons, "electrons"},
    {"projector's gamma", &Measured::projector_gamma, ""},
};

std::string text_of(const std::optional<double>& value) {
  return value ? fmt::format("{:.5g}", *value) : "";
}

std::string drift(const Record& record, const std::optional<Record>& before) {
  Rows rows;
  for (const Quantity& q : kQuantities) {
    const auto now = record.measured.*q.value;
    if (!now) continue;
    const auto then = before ? before->measured.*q.value : std::nullopt;
    rows.push_back(
        {q.name,
         text_of(now),
         text_of(then),
         then && *then != 0.0 ? fmt::format("{:+.3g} %", 100.0 * (*now / *then - 1.0)) : "",
         q.unit});
  }
  rows.push_back({"hot pixels",
                  std::to_string(record.measured.hot_pixels.size()),
                  before ? std::to_string(before->measured.hot_pixels.size()) : "",
                  "",
                  "pixels"});
  const std::string header = before ? fmt::format("version {}", before->version) : "before";
  return html::table({"quantity", "now", header, "change", "unit"}, rows, true) +
         (before ? "" : html::paragraph("There is no older calibration to compare with."));
}

std::string filled(std::string_view id, std::string_view title, const std::string& body) {
  return body.empty() ? std::string() : html::section(id, title, body);
}

}  // namespace

std::string calibration_page(const Record& record,
                             const std::optional<Record>& before,
                             std::span<const std::byte> poses_png,
                             const std::stop_token& stop) {
  const std::string title = fmt::format("Calibration {} of {}", record.version, record.station);
  std::string body = fmt::format("<h1>{}</h1>\n", html::escaped(title)) + summary(record);
  body += html::section("drift", "Measured, and drift", drift(record, before));
  body += html::section("gates", "Gates", gate_plot(record, before, stop) + gates_of(record));
  body += filled("dark", "Dark", dark_map_plot(record, stop));
  body += filled("response", "Response", response_plot(record, stop));
  body += filled("noise", "Noise", photon_transfer_plot(record, stop));
  body += filled("exposures", "Exposure times", exposure_plot(record, stop));
  body += filled("geometry", "Lenses", geometry_section(record, before, poses_png, stop));
  body += filled("colour", "Colour", patch_swatches(record) + patch_plot(record, stop));
  return html::page(title, body);
}

}  // namespace opaline::daemon
