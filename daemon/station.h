#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "base/clock.h"
#include "base/files.h"
#include "base/lock.h"
#include "daemon/catalogue.h"
#include "daemon/executor.h"
#include "daemon/new_session.h"
#include "daemon/supervisor.h"
#include "daemon/sweeper.h"

namespace opaline::daemon {

/// Everything that opalined serves: the sessions in one directory, and what is done with them. A
/// route calls one method of it. Thread-safe.
///
/// Errors of every method that takes an id: kNotFound.
class Station {
 public:
  struct Options {
    std::filesystem::path root;      ///< of the session directories; made if missing
    std::filesystem::path programs;  ///< where the stages' programs are
  };
  /// What a station knows of configurations (daemon/session_rules.h).
  struct Rules {
    std::function<Result<SessionDirectory::Contents>(const NewSession&)> contents;
    std::function<std::filesystem::path(const SessionDirectory&)> station_lock;
  };

  /// Reads the directory, and takes up every session that is not over. kBusy when another daemon
  /// serves the same directory.
  static Result<std::unique_ptr<Station>> create(const Options& options, Rules rules);

  Result<SessionSnapshot> create_session(const NewSession& wish);
  /// The newest 1000.
  Result<std::vector<CatalogueEntry>> list();
  /// How many sessions are in each state.
  Result<std::map<std::string, std::int64_t>> counts() { return catalogue_->counts(); }
  /// Those that are not over, as they were a moment ago.
  std::vector<SessionSnapshot> active() const { return supervisor_.snapshots(); }
  Result<SessionSnapshot> session(const std::string& id);
  /// The state of `id` as its supervisor sees it, which also knows of waiting.
  void refine(SessionSnapshot& snapshot) const;
  /// kBusy when the session is over already.
  Result<SessionSnapshot> cancel(const std::string& id);
  /// Tries again what failed or was cancelled. kBusy when there is nothing to resume.
  Result<SessionSnapshot> resume(const std::string& id);
  /// kBusy unless the session is over. The session is gone at once, its files soon after.
  Result<void> remove(const std::string& id);
  /// kInvalidArgument for one of a newer version.
  Result<SessionDirectory> directory(const std::string& id) const;
  const std::filesystem::path& root() const { return options_.root; }
  /// The session that has the devices behind a station's lock just now; empty when none of ours does.
  std::string user_of(const std::filesystem::path& station_lock) const;

 private:
  Station(Options options, Rules rules, FileLock lock, std::unique_ptr<Catalogue> catalogue);
  void take_up_sessions();
  void take_up(const std::filesystem::path& directory);
  void forget_missing();

  Options options_;
  Rules rules_;
  FileLock lock_;
  std::unique_ptr<Catalogue> catalogue_;
  Sweeper sweeper_;
  SystemClock clock_;
  LocalExecutor executor_;
  Supervisor supervisor_;  // last: its thread uses all of the above
};

}  // namespace opaline::daemon
