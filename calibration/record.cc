#include "calibration/record.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "base/camera_json.h"
#include "base/format_version.h"

namespace opaline::calibration {
namespace {

using nlohmann::json;
using nlohmann::ordered_json;

ordered_json to_json(const DeviceIdentity& device) {
  return {{"model", device.model},
          {"serial", device.serial},
          {"width", device.width},
          {"height", device.height},
          {"bit_depth", device.bit_depth}};
}

ordered_json to_json(const Gate& gate) {
  return {{"name", gate.name},
          {"value", gate.value},
          {"limit", gate.limit},
          {"unit", gate.unit},
          {"passed", gate.passed()},
          {"remedy", gate.remedy}};
}

ordered_json to_json(const StepRecord& step) {
  ordered_json gates = ordered_json::array();
  for (const Gate& gate : step.gates) gates.push_back(to_json(gate));
  return {{"step", step.step},
          {"finished", step.finished},
          {"accepted", step.accepted()},
          {"gates", std::move(gates)},
          {"values", step.values}};
}

std::string_view kind_name(capture::ResponseCurve::Kind kind) {
  switch (kind) {
    case capture::ResponseCurve::Kind::kGamma:
      return "gamma";
    case capture::ResponseCurve::Kind::kTable:
      return "table";
    case capture::ResponseCurve::Kind::kLinear:
      break;
  }
  return "linear";
}

ordered_json to_json(const MeasuredLens& lens) {
  ordered_json out = camera_to_json(lens.model);
  out["deviation"] = lens.deviation;
  return out;
}

ordered_json to_json(const Measured& m) {
  ordered_json out = ordered_json::object();
  const auto put = [&](const char* key, const std::optional<double>& value) {
    if (value) out[key] = *value;
  };
  put("black_level", m.black_level);
  if (m.black_level) {
    out["black_of_channels"] = m.black_of_channels;
    out["dark_codes_per_second"] = m.dark_codes_per_second;
    out["hot_pixels"] = m.hot_pixels;
  }
  put("clipping_code", m.clipping_code);
  if (m.response) {
    out["response"] = {{"kind", kind_name(m.response->kind)}, {"table", m.response->table}};
  }
  put("projector_gamma", m.projector_gamma);
  put("projector_black", m.projector_black);
  put("gain_electrons_per_code", m.gain_electrons_per_code);
  put("read_noise_electrons", m.read_noise_electrons);
  if (m.color) {
    out["color"] = {{"model", to_string(m.color->model)},
                    {"white_balance", m.color->white_balance},
                    {"coefficients", m.color->coefficients}};
  }
  for (const capture::ExposureFactor& f : m.exposure_factors)
    out["exposure_factors"].push_back({{"reported_s", f.reported_s}, {"factor", f.factor}});
  if (m.camera_lens) out["camera_lens"] = to_json(*m.camera_lens);
  if (m.projector_lens) out["projector_lens"] = to_json(*m.projector_lens);
  if (m.camera_vignetting) out["camera_vignetting"] = m.camera_vignetting->coefficients;
  if (m.projector_vignetting) out["projector_vignetting"] = m.projector_vignetting->coefficients;
  return out;
}

// These throw nlohmann's exceptions on what is missing or of another type; record_from_text() catches.
DeviceIdentity device_from(const json& in) {
  return {in.at("model").get<std::string>(),
          in.at("serial").get<std::string>(),
          in.at("width").get<int>(),
          in.at("height").get<int>(),
          in.at("bit_depth").get<int>()};
}

// JSON has no NaN or infinity: they are written as null.
double number_from(const json& in) {
  return in.is_null() ? std::numeric_limits<double>::quiet_NaN() : in.get<double>();
}

StepRecord step_from(const json& in) {
  StepRecord step{
      in.at("step").get<std::string>(), in.at("finished").get<std::string>(), {}, in.at("values")};
  for (const json& gate : in.at("gates")) {
    step.gates.push_back({gate.at("name").get<std::string>(),
                          number_from(gate.at("value")),
                          number_from(gate.at("limit")),
                          gate.at("unit").get<std::string>(),
                          gate.at("remedy").get<std::string>()});
  }
  return step;
}

capture::ResponseCurve response_from(const json& in) {
  const auto kind = in.at("kind").get<std::string>();
  capture::ResponseCurve response;
  if (kind == "table") response.kind = capture::ResponseCurve::Kind::kTable;
  response.table = in.at("table").get<std::vector<double>>();
  return response;
}

ColorCorrection color_from(const json& in) {
  ColorCorrection color;
  const bool matrix = in.at("model").get<std::string>() == to_string(ColorModel::kMatrix);
  color.model = matrix ? ColorModel::kMatrix : ColorModel::kRootPolynomial;
  color.white_balance = in.at("white_balance").get<CameraRgb>();
  color.coefficients = in.at("coefficients").get<std::vector<double>>();
  return color;
}

MeasuredLens lens_from(const json& in) {
  return {camera_from_json(in), in.at("deviation").get<std::array<double, 9>>()};
}

Measured measured_from(const json& in) {
  const auto number = [&](const char* key) {
    const auto found = in.find(key);
    return found == in.end() ? std::nullopt : std::optional(found->get<double>());
  };
  const auto vignetting = [&](const char* key) {
    const auto found = in.find(key);
    return found == in.end()
               ? std::nullopt
               : std::optional(capture::Vignetting{found->get<std::array<double, 3>>()});
  };
  Measured m;
  m.black_level = number("black_level");
  if (m.black_level) {
    m.black_of_channels = in.at("black_of_channels").get<std::array<double, 3>>();
    m.dark_codes_per_second = in.at("dark_codes_per_second").get<double>();
    m.hot_pixels = in.at("hot_pixels").get<std::vector<std::pair<int, int>>>();
  }
  m.clipping_code = number("clipping_code");
  if (in.contains("response")) m.response = response_from(in.at("response"));
  m.projector_gamma = number("projector_gamma");
  m.projector_black = number("projector_black");
  m.gain_electrons_per_code = number("gain_electrons_per_code");
  m.read_noise_electrons = number("read_noise_electrons");
  if (in.contains("color")) m.color = color_from(in.at("color"));
  for (const json& f : in.value("exposure_factors", json::array()))
    m.exposure_factors.push_back({f.at("reported_s").get<double>(), f.at("factor").get<double>()});
  if (in.contains("camera_lens")) m.camera_lens = lens_from(in.at("camera_lens"));
  if (in.contains("projector_lens")) m.projector_lens = lens_from(in.at("projector_lens"));
  m.camera_vignetting = vignetting("camera_vignetting");
  m.projector_vignetting = vignetting("projector_vignetting");
  return m;
}

}  // namespace

Result<std::size_t> step_index(std::string_view name) {
  const auto* const found = std::ranges::find(kSteps, name);
  if (found != kSteps.end()) return static_cast<std::size_t>(found - kSteps.begin());
  const auto* const extra = std::ranges::find(kExtraSteps, name);
  if (extra != kExtraSteps.end())
    return kSteps.size() + static_cast<std::size_t>(extra - kExtraSteps.begin());
  return invalid_argument(fmt::format("no step \"{}\"; there are {} and {}",
                                      name,
                                      fmt::join(kSteps, ", "),
                                      fmt::join(kExtraSteps, ", ")));
}

bool StepRecord::accepted() const { return std::ranges::all_of(gates, &Gate::passed); }

std::string_view to_string(RecordState state) {
  switch (state) {
    case RecordState::kIncomplete:
      return "incomplete";
    case RecordState::kRefused:
      return "refused";
    case RecordState::kAccepted:
      return "accepted";
  }
  return "incomplete";
}

const StepRecord* Record::find(std::string_view step) const {
  const auto found = std::ranges::find(steps, step, &StepRecord::step);
  return found == steps.end() ? nullptr : &*found;
}

void Record::put(StepRecord step) {
  const auto found = std::ranges::find(steps, step.step, &StepRecord::step);
  if (found != steps.end() && step.step == kSteps.front()) {
    *found = std::move(step);
    return;
  }
  const auto place = step_index(step.step);
  std::erase_if(steps, [&](const StepRecord& other) {
    const auto theirs = step_index(other.step);
    return place && theirs && *theirs >= *place;
  });
  steps.push_back(std::move(step));
}

RecordState Record::state() const {
  if (!std::ranges::all_of(steps, &StepRecord::accepted)) return RecordState::kRefused;
  return find(kSteps.back()) != nullptr ? RecordState::kAccepted : RecordState::kIncomplete;
}

double Record::margin() const {
  double most = steps.empty() ? std::numeric_limits<double>::infinity() : 0.0;
  for (const StepRecord& step : steps) {
    for (const Gate& gate : step.gates) {
      const double share = gate.limit > 0.0 ? gate.value / gate.limit : gate.passed() ? 0.0 : 2.0;
      most = std::isfinite(share) ? std::max(most, share) : std::numeric_limits<double>::infinity();
    }
  }
  return most;
}

std::string to_text(const Record& record) {
  ordered_json steps = ordered_json::array();
  for (const StepRecord& step : record.steps) steps.push_back(to_json(step));
  const ordered_json out{{"format", Record::kFormat},
                         {"version", record.version},
                         {"station", record.station},
                         {"state", to_string(record.state())},
                         {"created", record.created},
                         {"program", record.program},
                         {"camera", to_json(record.camera)},
                         {"projector", to_json(record.projector)},
                         {"steps", std::move(steps)},
                         {"measured", to_json(record.measured)}};
  return out.dump(2) + "\n";
}

Result<Record> record_from_text(std::string_view text, const std::string& file) {
  const json in = json::parse(text, nullptr, false);
  const auto format = in.is_object() ? format_of(in) : std::nullopt;
  if (!format) return invalid_argument(fmt::format("{} is damaged: it has no format", file));
  if (*format > Record::kFormat) return newer_format(file, *format, Record::kFormat);
  try {
    Record record;
    record.version = in.at("version").get<int>();
    record.station = in.at("station").get<std::string>();
    record.created = in.at("created").get<std::string>();
    record.program = in.at("program").get<std::string>();
    record.camera = device_from(in.at("camera"));
    record.projector = device_from(in.at("projector"));
    for (const json& step : in.at("steps")) record.steps.push_back(step_from(step));
    record.measured = measured_from(in.at("measured"));
    return record;
  } catch (const json::exception& e) {
    return invalid_argument(fmt::format("{} is damaged: {}", file, e.what()));
  }
}

}  // namespace opaline::calibration
