#include "capture/stage_projector.h"

#include "drivers/stage_picture.h"

namespace opaline::capture {

Result<drivers::ProjectorInfo> StageProjector::info() const {
  const auto stage = stage_.info();
  if (!stage) return stage.error();
  return drivers::ProjectorInfo{stage->model,
                                stage->serial,
                                static_cast<int>(stage->lights.size()) + 1,
                                1,
                                stage->period,
                                stage->latency};
}

Result<void> StageProjector::show(const drivers::Pattern& pattern, std::stop_token stop) {
  const auto wanted = drivers::stage_pattern(pattern);
  if (!wanted) return wanted.error();
  return stage_.set(*wanted, stop);
}

}  // namespace opaline::capture
