#include "config/agreement.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "capture/exposure_plan.h"
#include "capture/patterns.h"
#include "capture/surface_map.h"

namespace opaline::config {
namespace {

bool same_length(double a, double b) { return std::abs(a - b) <= 1e-6 * std::max(a, b); }

void report(Fields& fields, std::string_view key, const Result<void>& result) {
  if (!result) fields.check(false, key, result.error().message);
}

}  // namespace

bool Agreement::knows(std::initializer_list<std::string_view> rig_tables) const {
  return std::ranges::all_of(
      rig_tables, [&](std::string_view table) { return is_sound(rig_problems_, table); });
}

void Agreement::visit_simulated(Fields& fields, const capture::SampleGeometry& sample) const {
  const SimConfig& sim = rig_.sim;
  const Vec3 want = sim.scene.block.size();
  const Vec3 have = sample.block.size();
  fields.check(
      !knows({"sim.scene"}) || (same_length(want.x, have.x) && same_length(want.y, have.y) &&
                                same_length(want.z, have.z)),
      "size",
      fmt::format("the simulated sample measures {} x {} x {} mm", want.x, want.y, want.z));
  if (!knows({"sim.transport"})) return;
  fields.check(sim.transport.lit_face == sample.lit_face,
               "lit_face",
               fmt::format("the simulated light enters by {}", to_string(sim.transport.lit_face)));
  fields.check(sim.transport.seen_face == sample.seen_face,
               "seen_face",
               fmt::format("the simulated camera sees {}", to_string(sim.transport.seen_face)));
}

void Agreement::visit_sample(Fields& fields, const capture::SampleGeometry& sample) {
  if (!fields.is_sound() || !knows({"camera", "projector"})) return;
  if (rig_.is_simulated()) visit_simulated(fields, sample);
  if (knows({"sim.projector", "calibration.projector"})) {
    const auto covered = capture::check_patterns({.regions = 1, .held_out_lights = 0},
                                                 sample.block,
                                                 sample.lit_face,
                                                 rig_.calibration.projector);
    covers_face_ = covered.has_value();
    report(fields, "size", covered);
  }
  const bool other_face = rig_.is_simulated() && rig_.sim.transport.seen_face != sample.seen_face;
  if (knows({"sim.camera", "calibration.camera"}) && !other_face) {
    report(
        fields,
        "seen_face",
        capture::SurfaceMap::check(sample.block, sample.seen_face, rig_.calibration.camera.model));
  }
}

void Agreement::visit_patterns(Fields& fields,
                               const capture::PatternOptions& patterns,
                               const capture::SampleGeometry& sample) const {
  if (!covers_face_) return;
  report(
      fields,
      "regions",
      capture::check_patterns(patterns, sample.block, sample.lit_face, rig_.calibration.projector));
}

void Agreement::visit_exposures(Fields& fields, const capture::ExposureOptions& exposures) const {
  if (!fields.is_sound() || !knows({"camera", "projector", "sim.camera", "sim.projector"})) return;
  // Photographs say only in their folder what they are.
  capture::ExposureLimits limits{{}, {}, std::chrono::nanoseconds::max()};
  if (rig_.projector == Driver::kSim) limits.wheel_period = rig_.sim.rig.projector.wheel_turn;
  if (rig_.camera == Driver::kSim) {
    limits.shortest = rig_.sim.rig.camera.shortest_exposure;
    limits.longest = rig_.sim.rig.camera.longest_exposure;
  }
  const auto ladder = capture::exposure_ladder(exposures, limits);
  if (ladder) return;
  capture::ExposureOptions coarse = exposures;
  coarse.ratio = 16.0;
  const bool ratio_is_to_blame = capture::exposure_ladder(coarse, limits).has_value();
  fields.check(false, ratio_is_to_blame ? "ratio" : "longest", ladder.error().message);
}

}  // namespace opaline::config
