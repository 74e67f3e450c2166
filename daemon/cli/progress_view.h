#pragma once

#include <chrono>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "base/clock.h"

namespace opaline::daemon {

/// "capture  light 5/24  region_1_2  exposure 0.5 s  21 %  0:35 left", or
/// "reconstruct: reconstruction  channel red  iteration 12  objective 0.0123  chi2/datum 1.05", from
/// a progress event's data: the step, every figure of its detail, the fraction and the time left.
std::string progress_line(std::string_view stage, const nlohmann::json& progress);

/// A session's events for people: on a terminal one line that changes, and a lasting line for what
/// matters; elsewhere lasting lines only, of progress at most one in two seconds.
class ProgressView {
 public:
  struct Options {
    bool terminal = false;
    int columns = 100;
  };
  ProgressView(Options options, const Clock& clock) : options_(options), clock_(clock) {}

  /// An entry of the event log.
  void on_event(const std::string& type, const nlohmann::json& data);
  /// The session's state has changed; JSON as GET /v1/sessions/{id} gives it.
  void on_state(const nlohmann::json& session);
  /// A lasting line, below what was there.
  void say(const std::string& line);

 private:
  void on_progress(const nlohmann::json& data);
  void clear();

  Options options_;
  const Clock& clock_;  // outlives us
  std::string stage_;
  std::string step_;
  std::optional<std::chrono::nanoseconds> shown_at_;
  bool line_open_ = false;
};

}  // namespace opaline::daemon
