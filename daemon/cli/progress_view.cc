#include "daemon/cli/progress_view.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <vector>

#include "daemon/json_text.h"

namespace opaline::daemon {
namespace {

constexpr std::chrono::seconds kPlainPeriod{2};

std::string figure(const nlohmann::json& value) {
  if (value.is_string()) return value.get<std::string>();
  if (value.is_number_float()) return fmt::format("{:.4g}", value.get<double>());
  if (value.is_number() || value.is_boolean()) return value.dump();
  return {};
}

std::string duration(double seconds) {
  const auto whole = static_cast<long>(std::lround(std::max(0.0, seconds)));
  return fmt::format("{}:{:02}", whole / 60, whole % 60);
}

// In the order that an operator reads; what is not named here comes after.
constexpr std::array<std::string_view, 8> kOrder{"rung",
                                                 "light",
                                                 "region",
                                                 "exposure",
                                                 "channel",
                                                 "iteration",
                                                 "objective",
                                                 "chi_squared_per_datum"};

std::vector<std::string> keys_in_order(const nlohmann::json& detail) {
  std::vector<std::string> keys;
  for (const auto& [key, value] : detail.items()) keys.push_back(key);
  std::ranges::stable_sort(keys, {}, [](const std::string& key) {
    return std::ranges::find(kOrder, key) - kOrder.begin();
  });
  return keys;
}

// "light" beside "lights" reads "light 5/24"; "region" with "region_1_2" only the latter.
std::string details(const nlohmann::json& detail) {
  std::string line;
  for (const std::string& key : keys_in_order(detail)) {
    if (key.ends_with('s') && detail.contains(key.substr(0, key.size() - 1))) continue;
    const std::string text = figure(detail[key]);
    if (text.empty()) continue;
    const std::string label = key == "chi_squared_per_datum" ? "chi2/datum" : key;
    line += text.starts_with(key) ? "  " + text : fmt::format("  {} {}", label, text);
    const auto total = detail.find(key + "s");
    if (total != detail.end() && total->is_number()) line += "/" + total->dump();
  }
  return line;
}

// What an operator follows besides the stages; other facts are for programs.
bool is_notable(std::string_view type) {
  constexpr std::array<std::string_view, 7> kEndings{
      ".failed", ".retaken", ".damaged", ".unusable", ".warning", ".masked", ".measured"};
  return std::ranges::any_of(kEndings, [&](std::string_view end) { return type.ends_with(end); });
}

}  // namespace

std::string progress_line(std::string_view stage, const nlohmann::json& progress) {
  if (!progress.is_object()) return std::string(stage);
  const std::string step = text_of(progress, "step");
  std::string line(stage);
  if (!step.empty() && step != stage) line += (line.empty() ? "" : ": ") + step;
  if (const auto it = progress.find("detail"); it != progress.end() && it->is_object()) {
    line += details(*it);
  }
  if (const auto it = progress.find("fraction"); it != progress.end() && it->is_number()) {
    line += fmt::format("  {:.0f} %", 100.0 * std::clamp(it->get<double>(), 0.0, 1.0));
  }
  if (const auto it = progress.find("seconds_left"); it != progress.end() && it->is_number()) {
    line += fmt::format("  {} left", duration(it->get<double>()));
  }
  return line;
}

void ProgressView::on_event(const std::string& type, const nlohmann::json& data) {
  if (!data.is_object()) return;
  if (type == "progress") {
    on_progress(data);
  } else if (type == "job.started") {
    stage_ = text_of(data, "job");
    step_.clear();
    say(stage_ + ": started");
  } else if (type == "job.finished") {
    const std::string message = text_of(data, "message");
    say(fmt::format("{}: {}{}",
                    text_of(data, "job"),
                    text_of(data, "outcome"),
                    message.empty() ? "" : " (" + message + ")"));
  } else if (is_notable(type)) {
    const std::string message = text_of(data, "message");
    const std::string region = text_of(data, "region");
    say(fmt::format("{}: {} {}{}{}",
                    stage_,
                    type,
                    region,
                    region.empty() ? "" : ": ",
                    message.empty() ? data.dump() : message));
  }
}

void ProgressView::on_progress(const nlohmann::json& data) {
  const std::string step = text_of(data, "step");
  const auto now = clock_.now();
  const std::string line = progress_line(stage_, data);
  if (options_.terminal) {
    clear();
    fmt::print("{}", line.substr(0, static_cast<std::size_t>(std::max(1, options_.columns - 1))));
    std::fflush(stdout);
    line_open_ = true;
  } else if (step != step_ || !shown_at_ || now - *shown_at_ >= kPlainPeriod) {
    say(line);
    shown_at_ = now;
  }
  step_ = step;
}

void ProgressView::on_state(const nlohmann::json& session) {
  const std::string state = text_of(session, "state");
  if (state == "waiting for station") say("waiting: " + text_of(session, "message"));
  if (state == "cancelling") say("stopping, cleanly");
}

void ProgressView::say(const std::string& line) {
  clear();
  fmt::print("{}\n", line);
  std::fflush(stdout);
}

void ProgressView::clear() {
  if (!line_open_) return;
  fmt::print("\r\x1b[K");
  line_open_ = false;
}

}  // namespace opaline::daemon
