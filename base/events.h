#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "base/result.h"

namespace opaline {

/// How far a long piece of work is; shown to people, worth nothing once it is over.
struct Progress {
  std::string step;                    ///< "capture", "homogeneous fit", ...
  double fraction = 0.0;               ///< 0 to 1, of the step
  std::optional<double> seconds_left;  ///< of the step, when it can be told
  nlohmann::json detail =
      nlohmann::json::object();  ///< region, exposure, objective, iteration, ...
};

/// Where long work says what it does. Thread-safe in every implementation.
class EventSink {
 public:
  virtual ~EventSink() = default;
  /// Cheap; may be dropped or thinned.
  virtual void progress(const Progress& progress) = 0;
  /// A durable fact: on disk when this returns. `type` is dotted lower case, "region.captured".
  virtual Result<void> fact(std::string_view type, const nlohmann::json& data) = 0;
};

/// Hears nothing; for tests and benchmarks.
class NullSink : public EventSink {
 public:
  void progress(const Progress& /*progress*/) override {}
  Result<void> fact(std::string_view /*type*/, const nlohmann::json& /*data*/) override {
    return ok();
  }
};

}  // namespace opaline
