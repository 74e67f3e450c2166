#include "daemon/cancel_wish.h"

#include "base/clock.h"

namespace opaline::daemon {
namespace {

std::filesystem::path file_of(const SessionDirectory& session) {
  return session.path() / "cancel.requested";
}

}  // namespace

Result<void> wish_cancel(FileOperations& files, const SessionDirectory& session) {
  return write_whole(files, file_of(session), utc_now() + "\n");
}

Result<void> forget_cancel(FileOperations& files, const SessionDirectory& session) {
  if (!is_cancel_wished(session)) return ok();
  if (auto removed = files.remove(file_of(session)); !removed) return removed;
  return files.sync_directory(session.path());
}

bool is_cancel_wished(const SessionDirectory& session) {
  std::error_code none;
  return std::filesystem::exists(file_of(session), none);
}

}  // namespace opaline::daemon
