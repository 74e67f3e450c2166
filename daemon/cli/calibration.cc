#include "daemon/cli/calibration.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cstdio>
#include <map>
#include <optional>
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

void print_step(const StepRecord& step) {
  fmt::print("\n{} {}  {}\n", step.step, step.accepted() ? "accepted" : "REFUSED", step.finished);
  for (const Gate& gate : step.gates) {
    fmt::print("  {} {:<30} {:<10.4g} at most {:.4g} {}\n",
               gate.passed() ? " " : "!",
               gate.name,
               gate.value,
               gate.limit,
               gate.unit);
    if (!gate.passed()) fmt::print("      {}\n", gate.remedy);
  }
  for (const auto& [key, value] : step.values.items()) {
    const std::string text = value.dump();
    fmt::print("    {} = {}\n", key, text.size() > 160 ? text.substr(0, 157) + "..." : text);
  }
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
  return figures;
}

}  // namespace

Result<void> list_calibrations(const CalibrationPlace& place) {
  const auto store = store_of(place);
  if (!store) return store.error();
  const auto active = store->active();
  if (!active) return active.error();
  fmt::print("   version  state       created                   worst figure\n");
  for (const int version : store->versions()) {
    const auto record = store->read(version);
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
  fmt::print("\nfile {}\n", (store->directory_of(record->version) / "calibration.json").string());
  return ok();
}

Result<void> activate_calibration(const CalibrationPlace& place, int version) {
  const auto store = store_of(place);
  if (!store) return store.error();
  if (auto done = store->activate(version); !done) return done;
  fmt::print("calibration {} is active: sessions begun from now on use it\n", version);
  return ok();
}

Result<void> diff_calibrations(const CalibrationPlace& place, int before, int after) {
  const auto store = store_of(place);
  if (!store) return store.error();
  const auto old = record_of(*store, before);
  if (!old) return old.error();
  const auto fresh = record_of(*store, after);
  if (!fresh) return fresh.error();
  const auto was = figures_of(*old);
  fmt::print("{:<48} {:>12} {:>12} {:>9}\n",
             "",
             fmt::format("version {}", old->version),
             fmt::format("version {}", fresh->version),
             "change");
  for (const auto& [name, value] : figures_of(*fresh)) {
    const auto found = was.find(name);
    if (found == was.end()) {
      fmt::print("{:<48} {:>12} {:>12.5g}\n", name, "", value);
    } else if (found->second != value) {
      const double change = 100.0 * (value / found->second - 1.0);
      fmt::print("{:<48} {:>12.5g} {:>12.5g} {:>+8.2f}%\n", name, found->second, value, change);
    }
  }
  return ok();
}

}  // namespace opaline::daemon
