#include "reconstruct/inverse_result.h"

#include "base/ensure.h"

namespace opaline::reconstruct {

std::string_view to_string(StopReason reason) {
  switch (reason) {
    case StopReason::kDiscrepancy:
      return "discrepancy";
    case StopReason::kStalled:
      return "stalled";
    case StopReason::kNoDescent:
      return "no_descent";
    case StopReason::kIterationLimit:
      return "iteration_limit";
  }
  ENSURE(false);
  return "";
}

std::string_view explain(StopReason reason) {
  switch (reason) {
    case StopReason::kDiscrepancy:
      return "the pictures are explained to within their measured noise and the model's error";
    case StopReason::kStalled:
      return "the objective hardly falls any more";
    case StopReason::kNoDescent:
      return "no step lowers the objective: a minimum, to the accuracy of the solves";
    case StopReason::kIterationLimit:
      return "the limit of iterations was reached";
  }
  ENSURE(false);
  return "";
}

}  // namespace opaline::reconstruct
