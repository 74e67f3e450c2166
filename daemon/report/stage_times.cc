#include "daemon/report/stage_times.h"

#include <ctime>

#include <cstdlib>

namespace opaline::daemon {
namespace {

std::string text_in(const Event& event, const char* key) {
  const auto found = event.data.find(key);
  return found != event.data.end() && found->is_string() ? found->get<std::string>() : "";
}

void count(const Event& event, SessionFacts& facts) {
  if (event.type == "job.started" && ++facts.runs == 1) facts.begun = event.time;
  if (event.type == "region.captured") ++facts.regions_captured;
  if (event.type == "region.retaken") ++facts.regions_retaken;
  if (event.type == "region.unsteady" || event.type == "sample.moved")
    facts.unsteady.push_back(text_in(event, "message"));
  if (event.type == "calibration.used") facts.calibration = text_in(event, "message");
  if (event.type == "placement.measured") {
    if (!facts.calibration.empty()) facts.calibration += "; ";
    facts.calibration += text_in(event, "message");
  }
  if (event.type == "calibration.warning")
    facts.calibration_warnings.push_back(text_in(event, "message"));
  if (event.type == "region.unusable") {
    facts.unusable.push_back(text_in(event, "region") + ": " + text_in(event, "message"));
  }
}

}  // namespace

double SessionFacts::total_seconds() const {
  double total = 0.0;
  for (const auto& [stage, seconds] : stage_seconds) total += seconds;
  return total;
}

SessionFacts facts_of(const std::vector<Event>& events) {
  SessionFacts facts;
  std::string stage;  // that is running
  double started = 0.0;
  double last = 0.0;  // sign of life
  for (const Event& event : events) {
    const double now = seconds_of(event.time);
    if (event.type == "job.started") {
      if (!stage.empty()) facts.stage_seconds[stage] += last - started;  // it was killed
      stage = text_in(event, "job");
      started = now;
    }
    last = now;
    if (event.type == "job.finished" && !stage.empty()) {
      facts.stage_seconds[stage] += now - started;
      stage.clear();
    }
    count(event, facts);
  }
  if (!stage.empty()) facts.stage_seconds[stage] += last - started;
  return facts;
}

double seconds_of(std::string_view utc) {
  std::tm parts{};
  const std::string text(utc);
  const char* rest = ::strptime(text.c_str(), "%Y-%m-%dT%H:%M:%S", &parts);
  if (rest == nullptr) return 0.0;
  const double fraction = *rest == '.' ? std::strtod(rest, nullptr) : 0.0;
  return static_cast<double>(::timegm(&parts)) + fraction;
}

}  // namespace opaline::daemon
