#include "sim/light_timeline.h"

#include <algorithm>
#include <utility>

#include "base/seconds.h"

namespace opaline::sim {
namespace {

constexpr std::size_t kRemembered = 256;

}  // namespace

void LightTimeline::change(std::chrono::nanoseconds when, Shown shown) {
  while (!changes_.empty() && changes_.back().when >= when) changes_.pop_back();
  changes_.push_back({when, std::move(shown)});
  if (changes_.size() > kRemembered) changes_.pop_front();
}

Shown LightTimeline::at(std::chrono::nanoseconds when) const {
  Shown shown;
  for (const Change& change : changes_) {
    if (change.when <= when) shown = change.shown;
  }
  return shown;
}

Shown LightTimeline::before(std::chrono::nanoseconds when) const {
  const Shown now = at(when);
  Shown previous;
  for (const Change& change : changes_) {
    if (change.when <= when && change.shown != now) previous = change.shown;
  }
  return previous;
}

std::vector<LightStretch> LightTimeline::during(std::chrono::nanoseconds start,
                                                std::chrono::nanoseconds duration) const {
  std::vector<LightStretch> stretches{{at(start), 0.0, 0.0}};
  for (const Change& change : changes_) {
    if (change.when <= start || change.when >= start + duration) continue;
    stretches.back().to_seconds = seconds(change.when - start);
    stretches.push_back({change.shown, seconds(change.when - start), 0.0});
  }
  stretches.back().to_seconds = seconds(duration);
  return stretches;
}

}  // namespace opaline::sim
