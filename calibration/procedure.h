#pragma once

#include <functional>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "base/events.h"
#include "base/result.h"
#include "calibration/attendant.h"
#include "calibration/geometry_options.h"
#include "calibration/record.h"
#include "capture/station.h"

namespace opaline::calibration {

/// Which steps are done.
struct ProcedureOptions {
  std::optional<std::string> only;  ///< one step; those before it must have been accepted
  GeometryOptions geometry = {};    ///< without a board there is no such step
  Attendant* attendant = nullptr;   ///< outlives the procedure; perhaps nobody
};

/// Keeps the record on disk after each step.
using Keep = std::function<Result<void>(const Record&)>;

/// Takes a record through its steps in order. Steps accepted already are not done again, but the warm-up, without which none
/// of the others counts, is always; the first one refused ends the procedure, for nothing after it could be believed.
///
/// Facts: step.finished {step, accepted, message}, pose.taken (posing.h), and frame.retaken. Progress: by step.
/// Errors: kInvalidArgument when `only` lacks a step before it, or a board, or the devices are not those of the record; and what the
/// devices return. A gate that fails is not an error: see Record::state().
Result<void> run_procedure(Record& record,
                           const ProcedureOptions& options,
                           const capture::StationCalibration& given,
                           const capture::Station& station,
                           const Keep& keep,
                           EventSink& events,
                           std::stop_token stop);

/// "black_level: hot pixels is 0.1 of all pixels, at most 0.01 is accepted: cool the camera, or replace it"
std::string refusal(const StepRecord& step);

/// What a station says against a calibration that was made earlier.
struct Agreement {
  std::string wrong;  ///< why it must not be used; empty: nothing
  std::vector<std::string> doubts;
  bool operator==(const Agreement&) const = default;
};

/// Asks a station whether a calibration still holds, in some seconds: by its devices' names and sizes; by a dark frame (5 % of
/// black or 0.05 % of the code range off is doubtful, ten times that wrong); and by two lights, whose codes are as 3 to 2 (0.05
/// of gamma off is doubtful, 0.3 wrong; not asked where the sample is too dark or too bright).
/// Errors: what the devices return.
Result<Agreement> compare_with_station(const Record& record,
                                       const capture::StationCalibration& given,
                                       const capture::Station& station,
                                       EventSink& events,
                                       std::stop_token stop);

}  // namespace opaline::calibration
