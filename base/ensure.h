#pragma once

namespace opaline {

/// Logs the broken invariant and aborts; called by ENSURE.
[[noreturn]] void ensure_failed(const char* condition, const char* file, int line);

}  // namespace opaline

/// A broken invariant is a bug: logs and aborts in every build.
#define ENSURE(condition)                                       \
  do {                                                          \
    if (!(condition)) [[unlikely]]                              \
      ::opaline::ensure_failed(#condition, __FILE__, __LINE__); \
  } while (false)
