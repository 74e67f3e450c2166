#pragma once

#include <functional>
#include <string>

#include "base/session_directory.h"
#include "daemon/live_shows.h"

namespace opaline::daemon {

/// Objects of sessions' materials, shown while they are edited: "opaline-preview --live", by the session's id
/// (daemon/preview/live_object.h).
///
/// Threads: one. Errors of what takes an id: kNotFound.
class LiveObjects : public LiveShows {
 public:
  /// `directory` answers the session of an id. `executor` and `files` outlive us.
  using Directory = std::function<Result<SessionDirectory>(const std::string& id)>;
  LiveObjects(Directory directory, Executor& executor, FileOperations& files)
      : LiveShows(executor, files), directory_(std::move(directory)) {}

  /// Starts showing, unless it is shown, and says what look() says. Errors: kBusy before the session has a material.
  Result<nlohmann::json> start(const std::string& id);
  /// Asks whoever shows it to end, which it does soon. Errors: kBusy when nobody does.
  Result<void> stop(const std::string& id);
  /// An edit, undo, redo, look or shine, as its socket takes it. Errors: kInvalidArgument; kBusy where there is nothing to
  /// take back or nobody shows it.
  Result<void> wish(const std::string& id, const nlohmann::json& request);

 private:
  Result<std::filesystem::path> directory_of(const std::string& id) const override;
  Error nothing_shown(const std::string& id) const override;
  const char* key() const override { return "session"; }

  Directory directory_;
};

}  // namespace opaline::daemon
