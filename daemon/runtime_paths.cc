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

fs::path default_sessions() {
  if (const std::string named = variable("OPALINE_SESSIONS"); !named.empty()) return named;
  if (const std::string data = variable("XDG_DATA_HOME"); !data.empty()) {
    return fs::path(data) / "opaline" / "sessions";
  }
  const std::string home = variable("HOME");
  return fs::path(home.empty() ? "." : home) / ".local" / "share" / "opaline" / "sessions";
}

}  // namespace opaline::daemon
