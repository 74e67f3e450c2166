#include "calibration/procedure.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <memory>
#include <utility>

#include "base/clock.h"
#include "calibration/step.h"

namespace opaline::calibration {
namespace {

using Step = Result<StepRecord> (*)(StepContext&);
constexpr std::array<Step, kSteps.size() + kExtraSteps.size()> kDo{
    warm_up, black_level, linearity, radiometric, geometry, check, color};

std::string_view name_of_step(std::size_t step) {
  return step < kSteps.size() ? kSteps[step] : kExtraSteps[step - kSteps.size()];
}

DeviceIdentity identity_of(const drivers::CameraInfo& camera) {
  return {camera.model, camera.serial, camera.width, camera.height, camera.bit_depth};
}

DeviceIdentity identity_of(const drivers::ProjectorInfo& projector) {
  return {projector.model, projector.serial, projector.width, projector.height, 0};
}

std::string name_of(const DeviceIdentity& device) {
  return fmt::format("{} ({}), {} x {}", device.model, device.serial, device.width, device.height);
}

Result<void> same_devices(Record& record, const FrameTaker& taker) {
  const DeviceIdentity camera = identity_of(taker.camera());
  const DeviceIdentity projector = identity_of(taker.projector());
  if (record.steps.empty()) {
    record.camera = camera;
    record.projector = projector;
  }
  if (record.camera == camera && record.projector == projector) return ok();
  return invalid_argument(
      fmt::format("calibration {} was begun with {} and {}, and now there are {} and {}: begin a "
                  "new one, without --resume",
                  record.version,
                  name_of(record.camera),
                  name_of(record.projector),
                  name_of(camera),
                  name_of(projector)));
}

bool accepted_before(const Record& record, std::size_t step) {
  const StepRecord* const found = record.find(kSteps[step]);
  return found != nullptr && found->accepted();
}

bool is_part(std::size_t step, const GeometryOptions& geometry) {
  return name_of_step(step) != kGeometryStep || geometry.has_board();
}

Result<void> check_order(const Record& record,
                         std::size_t wanted,
                         const GeometryOptions& geometry) {
  if (!is_part(wanted, geometry))
    return invalid_argument(
        "step geometry needs a board: describe it in [calibration.board] of the rig file");
  for (std::size_t i = 1; i < std::min(wanted, kSteps.size()); ++i) {
    if (accepted_before(record, i) || !is_part(i, geometry)) continue;
    return invalid_argument(
        fmt::format("step {} needs {}, which has not been accepted: do that first, with "
                    "\"--step {}\", or all with \"--resume\"",
                    name_of_step(wanted),
                    kSteps[i],
                    kSteps[i]));
  }
  return ok();
}

Result<void> note(EventSink& events, const StepRecord& step) {
  return events.fact(
      "step.finished",
      {{"step", step.step},
       {"accepted", step.accepted()},
       {"message", step.accepted() ? fmt::format("{} accepted", step.step) : refusal(step)}});
}

bool is_due(const Record& record, std::size_t step, const std::optional<std::size_t>& only) {
  if (step == 0) return true;
  if (step >= kSteps.size()) return only && step == *only;
  return only ? step == *only : !accepted_before(record, step);
}

}  // namespace

std::string refusal(const StepRecord& step) {
  std::string text;
  for (const Gate& gate : step.gates) {
    if (gate.passed()) continue;
    text += fmt::format("{}{}: {}", text.empty() ? "" : "; ", step.step, gate.name);
    if (!gate.unit.empty())
      text += fmt::format(
          " is {:.3g} {}, at most {:.3g} is accepted", gate.value, gate.unit, gate.limit);
    text += fmt::format(": {}", gate.remedy);
  }
  return text;
}

Result<void> run_procedure(Record& record,
                           const ProcedureOptions& options,
                           const capture::StationCalibration& given,
                           const capture::Station& station,
                           const Keep& keep,
                           EventSink& events,
                           std::stop_token stop) {
  std::optional<std::size_t> only;
  if (options.only) {
    const auto index = step_index(*options.only);
    if (!index) return index.error();
    if (auto order = check_order(record, *index, options.geometry); !order) return order;
    only = *index;
  }
  const auto taker = FrameTaker::create(station, events);
  if (!taker) return taker.error();
  if (auto same = same_devices(record, **taker); !same) return same;
  if (options.attendant != nullptr)
    (*taker)->show_frames_to([&](const Frame& frame) { options.attendant->saw(frame); });
  StepContext context{
      **taker, given, record, events, stop, {}, options.geometry, options.attendant};
  for (std::size_t i = 0; i < kDo.size(); ++i) {
    if (!is_part(i, options.geometry) || !is_due(record, i, only)) continue;
    context.step = name_of_step(i);
    auto done = kDo[i](context);
    if (!done) return done.error().in(std::string(name_of_step(i)));
    done->finished = utc_now();
    const bool accepted = done->accepted();
    if (auto noted = note(events, *done); !noted) return noted;
    record.put(*std::move(done));
    if (auto kept = keep(record); !kept) return kept;
    if (!accepted) break;
  }
  return ok();
}

}  // namespace opaline::calibration
