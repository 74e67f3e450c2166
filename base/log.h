#pragma once

#include <fmt/format.h>

#include <string_view>
#include <utility>

/// One line per event, with its numbers, to stderr for the journal. Thread-safe.
///   log::info("capture {}: {} exposures in {} ms", id, n, elapsed_ms);
namespace opaline::log {

enum class Level { kDebug, kInfo, kWarning, kError, kCritical };

void set_level(Level level);
void write(Level level, std::string_view line);

template <class... Args>
void debug(fmt::format_string<Args...> format, Args&&... args) {
  write(Level::kDebug, fmt::format(format, std::forward<Args>(args)...));
}
template <class... Args>
void info(fmt::format_string<Args...> format, Args&&... args) {
  write(Level::kInfo, fmt::format(format, std::forward<Args>(args)...));
}
template <class... Args>
void warning(fmt::format_string<Args...> format, Args&&... args) {
  write(Level::kWarning, fmt::format(format, std::forward<Args>(args)...));
}
template <class... Args>
void error(fmt::format_string<Args...> format, Args&&... args) {
  write(Level::kError, fmt::format(format, std::forward<Args>(args)...));
}
template <class... Args>
void critical(fmt::format_string<Args...> format, Args&&... args) {
  write(Level::kCritical, fmt::format(format, std::forward<Args>(args)...));
}

}  // namespace opaline::log
