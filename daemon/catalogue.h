#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"

struct sqlite3;

namespace opaline::daemon {

/// What a list of sessions shows of one.
struct CatalogueEntry {
  std::string id;
  std::string name;
  std::string directory;
  std::string created;  ///< UTC
  std::string state;    ///< to_string(SessionState)
};

/// The sessions of a station in an SQLite file, so that a list need not read every event log. It
/// is only an index: the directories are the truth, and a missing, damaged or older file is made
/// anew. Thread-safe.
class Catalogue {
 public:
  /// A damaged file is set aside as FILE.damaged. Errors: kUnavailable.
  static Result<std::unique_ptr<Catalogue>> open(const std::filesystem::path& file);
  ~Catalogue();
  Catalogue(const Catalogue&) = delete;
  Catalogue& operator=(const Catalogue&) = delete;

  /// Adds or replaces.
  Result<void> put(const CatalogueEntry& entry);
  Result<void> set_state(const std::string& id, const std::string& state);
  Result<void> remove(const std::string& id);
  Result<std::optional<CatalogueEntry>> find(const std::string& id);
  /// How many sessions are in each state.
  Result<std::map<std::string, std::int64_t>> counts();
  /// The newest first, at most `limit`.
  Result<std::vector<CatalogueEntry>> list(int limit);

 private:
  explicit Catalogue(sqlite3* database) : database_(database) {}
  std::mutex mutex_;
  sqlite3* database_;  // guarded by mutex_
};

}  // namespace opaline::daemon
