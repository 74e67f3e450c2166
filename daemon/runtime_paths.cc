#include "daemon/runtime_paths.h"

#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <string>

namespace opaline::daemon {
namespace {

namespace fs = std::filesystem;

std::string variable(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? "" : value;
}

fs::path user_data(const char* named_by, const char* what) {
  if (const std::string named = variable(named_by); !named.empty()) return named;
  if (const std::string data = variable("XDG_DATA_HOME"); !data.empty())
    return fs::path(data) / "opaline" / what;
  const std::string home = variable("HOME");
  return fs::path(home.empty() ? "." : home) / ".local" / "share" / "opaline" / what;
}

}  // namespace

Result<fs::path> runtime_directory() {
  const std::string runtime = variable("XDG_RUNTIME_DIR");
  const fs::path directory = runtime.empty() ? fs::path(fmt::format("/tmp/opaline-{}", ::getuid()))
                                             : fs::path(runtime) / "opaline";
  if (::mkdir(directory.c_str(), S_IRWXU) != 0 && errno != EEXIST) {
    return unavailable(fmt::format("cannot create {}", directory.string()));
  }
  struct stat status {};
  if (::lstat(directory.c_str(), &status) != 0 || !S_ISDIR(status.st_mode) ||
      status.st_uid != ::getuid() || (status.st_mode & (S_IWGRP | S_IWOTH)) != 0) {
    return unavailable(fmt::format("{} is not this user's own directory", directory.string()));
  }
  return directory;
}

Result<fs::path> default_socket() {
  if (const std::string named = variable("OPALINE_SOCKET"); !named.empty()) return fs::path(named);
  const Result<fs::path> directory = runtime_directory();
  if (!directory) return directory.error();
  return *directory / "opalined.sock";
}

Result<fs::path> live_root() {
  const Result<fs::path> directory = runtime_directory();
  if (!directory) return directory.error();
  return *directory / "live";
}

fs::path default_sessions() { return user_data("OPALINE_SESSIONS", "sessions"); }

fs::path default_calibrations() { return user_data("OPALINE_CALIBRATIONS", "calibrations"); }

}  // namespace opaline::daemon
