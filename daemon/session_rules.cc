#include "daemon/session_rules.h"

#include <fmt/format.h>

#include <array>

#include "base/log.h"
#include "config/rig_text.h"
#include "config/session_config.h"
#include "daemon/jobs/station_lock.h"

namespace opaline::daemon {
namespace {

Result<config::SessionConfig> parse(const NewSession& wish) {
  if (!wish.resolved_toml.empty()) {
    return config::parse_resolved({"resolved.toml", wish.resolved_toml, {}});
  }
  return config::parse_session({"session.toml", wish.session_toml, {}},
                               {"rig.toml", wish.rig_toml, {}});
}

Result<void> refuse_named_files(const config::RigConfig& rig) {
  for (const std::filesystem::path& named :
       {rig.replay_folder, rig.sim.socket, rig.sim.responses, rig.sim.cache}) {
    if (named.empty()) continue;
    return invalid_argument(fmt::format(
        "the rig names the file {}: only requests over the Unix socket may", named.string()));
  }
  return ok();
}

}  // namespace

Result<SessionDirectory::Contents> contents_of(const NewSession& wish) {
  const Result<config::SessionConfig> session = parse(wish);
  if (!session) return session.error();
  if (!wish.same_user) {
    if (auto refused = refuse_named_files(session->rig); !refused) return refused.error();
  }
  return SessionDirectory::Contents{wish.name.empty() ? session->name : wish.name,
                                    wish.session_toml,
                                    wish.rig_toml,
                                    config::to_toml(*session)};
}

Result<std::string> station_of(const std::string& rig_toml, bool same_user) {
  const Result<config::RigConfig> rig = config::parse_rig({"rig.toml", rig_toml, {}});
  if (!rig) return rig.error();
  if (!same_user) {
    if (auto refused = refuse_named_files(*rig); !refused) return refused.error();
  }
  return rig->station;
}

std::filesystem::path station_lock_of(const SessionDirectory& session) {
  const Result<config::SessionConfig> resolved = config::load_resolved(session);
  if (resolved) return station_lock_path(resolved->rig.station);
  log::warning("session {}: {}", session.id(), resolved.error().message);
  return {};
}

}  // namespace opaline::daemon
