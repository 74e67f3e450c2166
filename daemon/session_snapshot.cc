#include "daemon/session_snapshot.h"

#include "base/lock.h"
#include "daemon/cancel_wish.h"
#include "daemon/event_follower.h"

namespace opaline::daemon {
namespace {

nlohmann::json to_json(std::string_view name, const Stage& stage) {
  nlohmann::json json{{"name", name}, {"state", to_string(stage.state)}};
  if (!stage.message.empty()) json["message"] = stage.message;
  if (!stage.started.empty()) json["started"] = stage.started;
  if (!stage.finished.empty()) json["finished"] = stage.finished;
  return json;
}

}  // namespace

SessionSnapshot make_snapshot(const SessionDirectory& session,
                              const SessionHistory& history,
                              const Decision& decision) {
  SessionSnapshot snapshot;
  snapshot.id = session.id();
  snapshot.name = session.name();
  snapshot.directory = session.path().string();
  snapshot.state = decision.state;
  snapshot.stage = kStages[decision.stage];
  snapshot.message = history.stages()[decision.stage].message;
  snapshot.code = history.stages()[decision.stage].code;
  snapshot.stages = history.stages();
  snapshot.last_seq = history.last_seq();
  if (!is_over(decision.state)) snapshot.progress = history.progress();
  return snapshot;
}

Result<SessionSnapshot> read_snapshot(const SessionDirectory& session) {
  const Result<bool> alive = FileLock::is_held(session.lock());  // before the log: see supervisor
  if (!alive) return alive.error();
  const Result<std::vector<Event>> events = EventFollower(session.events()).poll();
  if (!events) return events.error();
  SessionHistory history;
  for (const Event& event : *events) history.apply(event);
  return make_snapshot(session, history, decide(history, *alive, is_cancel_wished(session)));
}

nlohmann::json to_json(const SessionSnapshot& snapshot) {
  nlohmann::json json{{"id", snapshot.id},
                      {"name", snapshot.name},
                      {"directory", snapshot.directory},
                      {"state", to_string(snapshot.state)},
                      {"stage", snapshot.stage},
                      {"message", snapshot.message},
                      {"seq", snapshot.last_seq},
                      {"stages", nlohmann::json::array()}};
  if (!snapshot.code.empty()) json["code"] = snapshot.code;
  if (!snapshot.progress.is_null()) json["progress"] = snapshot.progress;
  for (std::size_t i = 0; i < kStages.size(); ++i) {
    json["stages"].push_back(to_json(kStages[i], snapshot.stages[i]));
  }
  return json;
}

}  // namespace opaline::daemon
