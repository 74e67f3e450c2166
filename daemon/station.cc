#include "daemon/station.h"

#include <fmt/format.h>

#include <limits>

#include "base/log.h"
#include "daemon/cancel_wish.h"
#include "daemon/session_factory.h"

namespace opaline::daemon {
namespace {

namespace fs = std::filesystem;

constexpr int kListLimit = 1000;

// When a session was made stands at the front of its id.
std::string created_of(const std::string& id) {
  if (id.size() < 15) return id;
  return fmt::format("{}-{}-{}T{}:{}:{}Z",
                     id.substr(0, 4),
                     id.substr(4, 2),
                     id.substr(6, 2),
                     id.substr(9, 2),
                     id.substr(11, 2),
                     id.substr(13, 2));
}

CatalogueEntry entry_of(const SessionDirectory& session, SessionState state) {
  return {session.id(),
          session.name(),
          session.path().string(),
          created_of(session.id()),
          std::string(to_string(state))};
}

}  // namespace

Result<std::unique_ptr<Station>> Station::create(const Options& options, Rules rules) {
  if (auto made = system_files().make_directories(options.root); !made) return made.error();
  Result<FileLock> lock = FileLock::acquire(options.root / ".opalined.lock");
  if (!lock && lock.error().code == ErrorCode::kBusy) {
    return busy(fmt::format("another opalined serves {}", options.root.string()));
  }
  if (!lock) return lock.error();
  Result<std::unique_ptr<Catalogue>> catalogue =
      Catalogue::open(options.root / ".catalogue.sqlite");
  if (!catalogue) return catalogue.error();
  std::unique_ptr<Station> station(
      new Station(options, std::move(rules), *std::move(lock), *std::move(catalogue)));
  station->take_up_sessions();
  return station;
}

Station::Station(Options options, Rules rules, FileLock lock, std::unique_ptr<Catalogue> catalogue)
    : options_(std::move(options)),
      rules_(std::move(rules)),
      lock_(std::move(lock)),
      catalogue_(std::move(catalogue)),
      executor_(options_.programs),
      supervisor_(
          {executor_, system_files(), clock_},
          {rules_.station_lock, [this](const SessionSnapshot& snapshot) {
             log::info(
                 "session {}: {} ({})", snapshot.id, to_string(snapshot.state), snapshot.stage);
             const auto set =
                 catalogue_->set_state(snapshot.id, std::string(to_string(snapshot.state)));
             if (!set) log::warning("{}", set.error().message);
           }}) {}

void Station::take_up_sessions() {
  for (fs::path& leftover : leftovers_in(options_.root)) sweeper_.remove(std::move(leftover));
  forget_missing();
  std::error_code error;
  for (fs::directory_iterator it(options_.root, error), end; !error && it != end;
       it.increment(error)) {
    if (is_session_id(it->path().filename().string())) take_up(it->path());
  }
  if (error) log::warning("{}: {}", options_.root.string(), error.message());
}

void Station::forget_missing() {
  const auto entries = catalogue_->list(std::numeric_limits<int>::max());
  if (!entries) return;
  for (const CatalogueEntry& entry : *entries) {
    std::error_code none;
    if (fs::exists(options_.root / entry.id / "session.json", none)) continue;
    if (auto removed = catalogue_->remove(entry.id); !removed) {
      log::warning("{}", removed.error().message);
    }
  }
}

// One that has succeeded stays so, and its log need not be read. What failed or was cancelled may have
// been resumed without our knowing: by hand, or by us just before we were killed.
void Station::take_up(const fs::path& directory) {
  const auto known = catalogue_->find(directory.filename().string());
  if (known && *known && (*known)->state == to_string(SessionState::kSucceeded)) return;
  const Result<SessionDirectory> session = SessionDirectory::open(directory);
  const Result<SessionSnapshot> snapshot =
      session ? read_snapshot(*session) : Result<SessionSnapshot>(session.error());
  if (!snapshot) {
    log::warning("{}", snapshot.error().message);
    return;
  }
  if (auto put = catalogue_->put(entry_of(*session, snapshot->state)); !put) {
    log::warning("{}", put.error().message);
  }
  if (!is_over(snapshot->state)) supervisor_.add(*session);
}

Result<SessionSnapshot> Station::create_session(const NewSession& wish) {
  const Result<SessionDirectory::Contents> contents = rules_.contents(wish);
  if (!contents) return contents.error();
  const Result<SessionDirectory> session = make_session(system_files(), options_.root, *contents);
  if (!session) return session.error();
  if (auto put = catalogue_->put(entry_of(*session, SessionState::kQueued)); !put) {
    log::warning("{}", put.error().message);  // an index only: made anew at the next start
  }
  supervisor_.add(*session);
  return make_snapshot(*session, SessionHistory(), decide(SessionHistory(), false, false));
}

Result<std::vector<CatalogueEntry>> Station::list() { return catalogue_->list(kListLimit); }

Result<SessionDirectory> Station::directory(const std::string& id) const {
  if (!is_session_id(id)) return not_found("there is no such session");
  std::error_code none;
  if (!fs::exists(options_.root / id / "session.json", none)) {
    return not_found(fmt::format("there is no session {}", id));
  }
  return SessionDirectory::open(options_.root / id);
}

Result<SessionSnapshot> Station::session(const std::string& id) {
  const Result<SessionDirectory> session = directory(id);
  if (!session) return session.error();
  Result<SessionSnapshot> snapshot = read_snapshot(*session);
  if (snapshot) refine(*snapshot);
  return snapshot;
}

void Station::refine(SessionSnapshot& snapshot) const {
  if (is_over(snapshot.state)) return;
  const std::optional<SessionSnapshot> supervised = supervisor_.snapshot(snapshot.id);
  if (!supervised || is_over(supervised->state)) return;
  if (snapshot.state == SessionState::kQueued || supervised->state == SessionState::kCancelling) {
    snapshot.state = supervised->state;
    snapshot.message = supervised->message;
  }
}

std::string Station::user_of(const fs::path& station_lock) const {
  for (const SessionSnapshot& snapshot : active()) {
    const bool runs =
        snapshot.state == SessionState::kRunning || snapshot.state == SessionState::kCancelling;
    if (!runs || snapshot.stage != kStationStage) continue;
    const Result<SessionDirectory> session = directory(snapshot.id);
    if (session && rules_.station_lock(*session) == station_lock) return snapshot.id;
  }
  return {};
}

Result<SessionSnapshot> Station::cancel(const std::string& id) {
  Result<SessionSnapshot> snapshot = session(id);
  if (!snapshot) return snapshot;
  if (is_over(snapshot->state)) {
    return busy(fmt::format("session {} is over already: {}", id, to_string(snapshot->state)));
  }
  const Result<SessionDirectory> session_directory = directory(id);
  if (!session_directory) return session_directory.error();
  if (auto wished = wish_cancel(system_files(), *session_directory); !wished) return wished.error();
  supervisor_.add(*session_directory);
  snapshot->state = SessionState::kCancelling;
  return snapshot;
}

Result<SessionSnapshot> Station::resume(const std::string& id) {
  const Result<SessionSnapshot> before = session(id);
  if (!before) return before.error();
  if (before->state != SessionState::kFailed && before->state != SessionState::kCancelled) {
    return busy(fmt::format("session {} is {}: nothing to resume", id, to_string(before->state)));
  }
  const Result<SessionDirectory> session_directory = directory(id);
  if (!session_directory) return session_directory.error();
  SessionSupervisor supervisor(*session_directory, {}, {executor_, system_files(), clock_});
  if (auto resumed = supervisor.resume(); !resumed) return resumed.error();
  supervisor_.add(*session_directory);
  return session(id);
}

Result<void> Station::remove(const std::string& id) {
  const Result<SessionSnapshot> snapshot = session(id);
  if (!snapshot) return snapshot.error();
  if (!is_over(snapshot->state)) {
    return busy(fmt::format("session {} is {}: cancel it first", id, to_string(snapshot->state)));
  }
  const Result<SessionDirectory> session_directory = directory(id);
  if (!session_directory) return session_directory.error();
  Result<fs::path> hidden = hide_session(system_files(), *session_directory);
  if (!hidden) return hidden.error();
  sweeper_.remove(*std::move(hidden));
  return catalogue_->remove(id);
}

}  // namespace opaline::daemon
