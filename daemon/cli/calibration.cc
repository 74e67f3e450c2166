#include "daemon/cli/calibration.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "calibration/store.h"

namespace opaline::daemon {
namespace {

using calibration::Gate;
using calibration::Record;
using calibration::StepRecord;
using calibration::Store;

Result<Store> store_of(const CalibrationPlace& place) {
  const std::vector<std::string> stations = calibration::stations_in(place.root);
  if (stations.empty()) {
    return not_found(fmt::format("no calibrations in {}: run \"opaline calibrate RIG.toml\"",
                                 place.root.string()));
  }
  if (place.station.empty() && stations.size() > 1) {
    return invalid_argument(fmt::format("which station? --station {}", fmt::join(stations, " | ")));
  }
  const std::string station = place.station.empty() ? stations.front() : place.station;
  for (const std::string& known : stations) {
    if (known == station) return Store(system_files(), place.root, station);
  }
  return not_found(fmt::format(
      "no calibrations of station \"{}\"; there are {}", station, fmt::join(stations, ", ")));
}

Result<Record> record_of(const Store& store, int version) {
  if (version > 0) return store.read(version);
  auto active = store.read_active();
  if (!active) return active.error();
  if (*active) return **std::move(active);
  return not_found(
      "none is active: name a version (\"opaline calibration list\" has them), or calibrate");
}

std::string worst_of(const Record& record) {
  std::string text;
  double most = -1.0;
  for (const StepRecord& step : record.steps) {
    for (const Gate& gate : step.gates) {
      const double share = gate.value / gate.limit;
      if (share <= most) continue;
      most = share;
      text = fmt::format("{}: {}, {:.0f} % of its limit", step.step, gate.name, 100.0 * share);
    }
  }
  return text;
}

// What fits on a line; the report draws the rest.
std::string shown_value(const nlohmann::json& value) {
  constexpr std::size_t kLongest = 120;
  if (value.is_number_float()) return fmt::format("{:.6g}", value.get<double>());
  std::string text = value.is_string() ? value.get<std::string>() : value.dump();
  if (text.size() <= kLongest || value.is_string()) return text;
  return fmt::format("{} values, in calibration.json and report.html", value.size());
}

void print_step(const StepRecord& step) {
  fmt::print("\n{} {}  {}\n", step.step, step.accepted() ? "accepted" : "REFUSED", step.finished);
  for (const Gate& gate : step.gates) {
    const char* const mark = gate.passed() ? " " : "!";
    if (gate.unit.empty()) {  // yes or no
      fmt::print("  {} {:<36} {}\n", mark, gate.name, gate.passed() ? "no" : "yes");
    } else {
      fmt::print("  {} {:<36} {:<10.4g} at most {:.4g} {}\n",
                 mark,
                 gate.name,
                 gate.value,
                 gate.limit,
                 gate.unit);
    }
    if (!gate.passed()) fmt::print("      {}\n", gate.remedy);
  }
  for (const auto& [key, value] : step.values.items())
    fmt::print("    {} = {}\n", key, shown_value(value));
}

// Of a figure that was 0 a share says nothing.
std::string change_of(double before, double after) {
  return before == 0.0 ? fmt::format("{:+.3g}", after)
                       : fmt::format("{:+.2f} %", 100.0 * (after / before - 1.0));
}

void put_lens(std::map<std::string, double>& figures,
              const char* name,
              const std::optional<calibration::MeasuredLens>& lens) {
  if (!lens) return;
  const CameraModel& model = lens->model;
  figures[fmt::format("{} fx, px", name)] = model.fx;
  figures[fmt::format("{} fy, px", name)] = model.fy;
  figures[fmt::format("{} cx, px", name)] = model.cx;
  figures[fmt::format("{} cy, px", name)] = model.cy;
  constexpr std::array<const char*, 5> kTerms{"k1", "k2", "p1", "p2", "k3"};
  for (std::size_t i = 0; i < kTerms.size(); ++i)
    figures[fmt::format("{} {}", name, kTerms[i])] = model.distortion[i];
}

// Every number of a record, by name.
std::map<std::string, double> figures_of(const Record& record) {
  std::map<std::string, double> figures;
  for (const StepRecord& step : record.steps) {
    for (const Gate& gate : step.gates) figures[step.step + ": " + gate.name] = gate.value;
    for (const auto& [key, value] : step.values.items()) {
      if (value.is_number()) figures[step.step + ": " + key] = value.get<double>();
    }
  }
  const calibration::Measured& m = record.measured;
  const auto put = [&](const char* name, const std::optional<double>& value) {
    if (value) figures[name] = *value;
  };
  put("black level, codes", m.black_level);
  put("clipping code", m.clipping_code);
  put("gain, electrons per code", m.gain_electrons_per_code);
  put("read noise, electrons", m.read_noise_electrons);
  put("projector gamma", m.projector_gamma);
  put_lens(figures, "camera lens", m.camera_lens);
  put_lens(figures, "projector lens", m.projector_lens);
  return figures;
}

Result<void> list_of(const Store& store) {
  const auto active = store.active();
  if (!active) return active.error();
  fmt::print("   version  state       created                   worst figure\n");
  for (const int version : store.versions()) {
    const auto record = store.read(version);
    if (!record) {
      fmt::print("   {:>7}  unreadable  {}\n", version, record.error().message);
      continue;
    }
    fmt::print("{}  {:>7}  {:<10}  {}  {}\n",
               *active == version ? "*" : " ",
               version,
               to_string(record->state()),
               record->created,
               worst_of(*record));
  }
  fmt::print("\n{}\n", *active ? "* is active: sessions use it" : "none is active");
  return ok();
}

}  // namespace

Result<void> list_calibrations(const CalibrationPlace& place) {
  const std::vector<std::string> stations = calibration::stations_in(place.root);
  if (!place.station.empty() || stations.size() < 2) {
    const auto store = store_of(place);
    return store ? list_of(*store) : Result<void>(store.error());
  }
  for (const std::string& station : stations) {
    fmt::print("station {}\n", station);
    if (auto listed = list_of(Store(system_files(), place.root, station)); !listed) return listed;
    fmt::print("\n");
  }
  return ok();
}

Result<void> show_calibration(const CalibrationPlace& place, int version) {
  const auto store = store_of(place);
  if (!store) return store.error();
  const auto record = record_of(*store, version);
  if (!record) return record.error();
  fmt::print("calibration {} of station {}, {}\ncreated    {} by opaline {}\n",
             record->version,
             record->station,
             to_string(record->state()),
             record->created,
             record->program);
  fmt::print("camera     {} ({}), {} x {}, {} bits\nprojector  {} ({}), {} x {}\n",
             record->camera.model,
             record->camera.serial,
             record->camera.width,
             record->camera.height,
             record->camera.bit_depth,
             record->projector.model,
             record->projector.serial,
             record->projector.width,
             record->projector.height);
  for (const StepRecord& step : record->steps) print_step(step);
  const auto directory = store->directory_of(record->version);
  std::error_code none;
  fmt::print("\nfile    {}\n", (directory / "calibration.json").string());
  if (std::filesystem::exists(directory / "report.html", none))
    fmt::print("report  {}\n", (directory / "report.html").string());
  return ok();
}

Result<void> activate_calibration(const CalibrationPlace& place, int version) {
  const auto store = store_of(place);
  if (!store) return store.error();
  if (auto done = store->activate(version); !done) return done;
  fmt::print("calibration {} is active: sessions begun from now on use it\n", version);
  return ok();
}

Result<void> roll_back_calibration(const CalibrationPlace& place) {
  const auto store = store_of(place);
  if (!store) return store.error();
  const auto active = store->active();
  if (!active) return active.error();
  if (!*active) return not_found("none is active: \"opaline calibration list\" has all");
  const auto before = store->used_before(**active);
  if (!before) return before.error();
  if (!*before)
    return not_found(fmt::format(
        "nothing to go back to: sessions have used none before calibration {}; \"opaline "
        "calibration activate VERSION\" takes any accepted one",
        **active));
  fmt::print("calibration {} is left, ", **active);
  return activate_calibration(place, **before);
}

Result<void> diff_calibrations(const CalibrationPlace& place, int before, int after) {
  const auto store = store_of(place);
  if (!store) return store.error();
  const auto old = record_of(*store, before);
  if (!old) return old.error();
  const auto fresh = record_of(*store, after);
  if (!fresh) return fresh.error();
  const auto was = figures_of(*old);
  const auto is = figures_of(*fresh);
  std::set<std::string> names;
  for (const auto& [name, value] : was) names.insert(name);
  for (const auto& [name, value] : is) names.insert(name);
  std::size_t same = 0;
  fmt::print("{:<48} {:>12} {:>12} {:>10}\n",
             "",
             fmt::format("version {}", old->version),
             fmt::format("version {}", fresh->version),
             "change");
  for (const std::string& name : names) {
    const auto a = was.find(name);
    const auto b = is.find(name);
    if (a != was.end() && b != is.end() && a->second == b->second) {
      ++same;
      continue;
    }
    fmt::print("{:<48} {:>12} {:>12} {:>10}\n",
               name,
               a == was.end() ? "-" : fmt::format("{:.5g}", a->second),
               b == is.end() ? "-" : fmt::format("{:.5g}", b->second),
               a == was.end() || b == is.end() ? "" : change_of(a->second, b->second));
  }
  fmt::print("{} figures are the same\n", same);
  return ok();
}

}  // namespace opaline::daemon
