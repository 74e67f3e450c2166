#include "daemon/catalogue.h"

#include <fmt/format.h>
#include <sqlite3.h>

#include <array>
#include <limits>
#include <string_view>

#include "base/log.h"

namespace opaline::daemon {
namespace {

namespace fs = std::filesystem;

constexpr int kSchema = 1;
constexpr int kBusyMs = 5000;
constexpr const char* kColumns = "SELECT id, name, directory, created, state FROM sessions ";

/// A prepared statement.
class Statement {
 public:
  Statement(sqlite3* database,
            const std::string& sql,
            std::initializer_list<std::string_view> texts)
      : database_(database) {
    if (::sqlite3_prepare_v2(database, sql.c_str(), -1, &statement_, nullptr) != SQLITE_OK) return;
    int index = 0;
    for (const std::string_view text : texts) {
      ::sqlite3_bind_text(statement_,
                          ++index,
                          text.data(),
                          static_cast<int>(text.size()),
                          SQLITE_TRANSIENT);  // NOLINT(performance-no-int-to-ptr)
    }
  }
  ~Statement() { ::sqlite3_finalize(statement_); }
  Statement(const Statement&) = delete;
  Statement& operator=(const Statement&) = delete;

  /// True for a row, false at the end.
  Result<bool> step() {
    const int code = statement_ == nullptr ? SQLITE_ERROR : ::sqlite3_step(statement_);
    if (code == SQLITE_ROW) return true;
    if (code == SQLITE_DONE) return false;
    return unavailable(fmt::format("catalogue: {}", ::sqlite3_errmsg(database_)));
  }
  std::string text(int column) const {
    const auto* text = ::sqlite3_column_text(statement_, column);
    return text == nullptr ? "" : reinterpret_cast<const char*>(text);
  }
  std::int64_t number(int column) const { return ::sqlite3_column_int64(statement_, column); }
  CatalogueEntry entry() const { return {text(0), text(1), text(2), text(3), text(4)}; }

 private:
  sqlite3* database_;
  sqlite3_stmt* statement_ = nullptr;
};

Result<void> execute(sqlite3* database,
                     const std::string& sql,
                     std::initializer_list<std::string_view> texts = {}) {
  Statement statement(database, sql, texts);
  for (;;) {
    const Result<bool> row = statement.step();
    if (!row) return row.error();
    if (!*row) return ok();
  }
}

Result<std::string> pragma(sqlite3* database, const std::string& name) {
  Statement statement(database, "PRAGMA " + name, {});
  const Result<bool> row = statement.step();
  if (!row) return row.error();
  return *row ? statement.text(0) : std::string();
}

Result<void> prepare(sqlite3* database) {
  ::sqlite3_busy_timeout(database, kBusyMs);
  const Result<std::string> mode = pragma(database, "journal_mode=WAL");
  if (!mode) return mode.error();
  const Result<std::string> check = pragma(database, "quick_check(1)");
  if (!check) return check.error();
  if (*check != "ok") return unavailable("catalogue: " + *check);
  const Result<std::string> version = pragma(database, "user_version");
  if (!version) return version.error();
  if (*version != "0" && *version != std::to_string(kSchema)) {
    return unavailable("catalogue: of another version");
  }
  if (auto made = execute(database,
                          "CREATE TABLE IF NOT EXISTS sessions (id TEXT PRIMARY KEY, name TEXT NOT "
                          "NULL, directory TEXT NOT NULL, created TEXT NOT NULL, state TEXT NOT "
                          "NULL) STRICT");
      !made) {
    return made;
  }
  return execute(database, fmt::format("PRAGMA user_version={}", kSchema));
}

// SQLite's handle; null with the reason logged when the file cannot be used.
sqlite3* try_open(const fs::path& file) {
  sqlite3* database = nullptr;
  const int flags = SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE | SQLITE_OPEN_NOMUTEX;
  const int code = ::sqlite3_open_v2(file.c_str(), &database, flags, nullptr);
  const Result<void> prepared =
      code == SQLITE_OK ? prepare(database)
                        : Result<void>(unavailable("catalogue: cannot open " + file.string()));
  if (prepared) return database;
  log::warning("{}: {}", file.string(), prepared.error().message);
  ::sqlite3_close(database);
  return nullptr;
}

void set_aside(const fs::path& file) {
  std::error_code ignored;
  fs::rename(file, file.string() + ".damaged", ignored);
  for (const char* companion : {"-wal", "-shm"}) fs::remove(file.string() + companion, ignored);
}

}  // namespace

Result<std::unique_ptr<Catalogue>> Catalogue::open(const fs::path& file) {
  sqlite3* database = try_open(file);
  if (database == nullptr) {
    set_aside(file);
    database = try_open(file);
  }
  if (database == nullptr) return unavailable("cannot use the catalogue " + file.string());
  return std::unique_ptr<Catalogue>(new Catalogue(database));
}

Catalogue::~Catalogue() { ::sqlite3_close(database_); }

Result<void> Catalogue::put(const CatalogueEntry& entry) {
  const std::lock_guard lock(mutex_);
  return execute(database_,
                 "INSERT OR REPLACE INTO sessions (id, name, directory, created, state) VALUES (?, "
                 "?, ?, ?, ?)",
                 {entry.id, entry.name, entry.directory, entry.created, entry.state});
}

Result<void> Catalogue::set_state(const std::string& id, const std::string& state) {
  const std::lock_guard lock(mutex_);
  return execute(database_, "UPDATE sessions SET state = ? WHERE id = ?", {state, id});
}

Result<void> Catalogue::remove(const std::string& id) {
  const std::lock_guard lock(mutex_);
  return execute(database_, "DELETE FROM sessions WHERE id = ?", {id});
}

Result<std::optional<CatalogueEntry>> Catalogue::find(const std::string& id) {
  const std::lock_guard lock(mutex_);
  Statement statement(database_, std::string(kColumns) + "WHERE id = ?", {id});
  const Result<bool> row = statement.step();
  if (!row) return row.error();
  return *row ? std::optional(statement.entry()) : std::nullopt;
}

Result<std::map<std::string, std::int64_t>> Catalogue::counts() {
  const std::lock_guard lock(mutex_);
  Statement statement(database_, "SELECT state, COUNT(*) FROM sessions GROUP BY state", {});
  std::map<std::string, std::int64_t> counts;
  for (;;) {
    const Result<bool> row = statement.step();
    if (!row) return row.error();
    if (!*row) return counts;
    counts[statement.text(0)] = statement.number(1);
  }
}

Result<std::vector<CatalogueEntry>> Catalogue::list(int limit) {
  const std::lock_guard lock(mutex_);
  Statement statement(
      database_, fmt::format("{}ORDER BY created DESC, id DESC LIMIT {}", kColumns, limit), {});
  std::vector<CatalogueEntry> entries;
  for (;;) {
    const Result<bool> row = statement.step();
    if (!row) return row.error();
    if (!*row) return entries;
    entries.push_back(statement.entry());
  }
}

}  // namespace opaline::daemon
