#include "daemon/jobs/job_events.h"

#include "base/log.h"

namespace opaline::daemon {
namespace {

constexpr std::chrono::milliseconds kProgressPeriod{200};

}  // namespace

nlohmann::json to_json(const Progress& progress) {
  nlohmann::json json{{"step", progress.step}, {"fraction", progress.fraction}};
  if (progress.seconds_left) json["seconds_left"] = *progress.seconds_left;
  if (!progress.detail.empty()) json["detail"] = progress.detail;
  return json;
}

bool JobEvents::is_due(const Progress& progress) {
  const auto now = clock_.now();
  if (written_at_ && progress.step == written_step_ && now - *written_at_ < kProgressPeriod) {
    return false;
  }
  written_at_ = now;
  written_step_ = progress.step;
  return true;
}

void JobEvents::progress(const Progress& progress) {
  nlohmann::json json = to_json(progress);
  {
    const std::lock_guard lock(mutex_);
    latest_ = json;
    if (!is_due(progress)) return;
  }
  const auto written = log_.append("progress", json, EventLog::Durability::kRelaxed);
  if (!written) log::debug("progress not logged: {}", written.error().message);
}

Result<void> JobEvents::fact(std::string_view type, const nlohmann::json& data) {
  if (auto written = log_.append(type, data); !written) return written.error();
  return ok();
}

nlohmann::json JobEvents::latest_progress() const {
  const std::lock_guard lock(mutex_);
  return latest_;
}

}  // namespace opaline::daemon
