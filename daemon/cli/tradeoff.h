#pragma once

#include <filesystem>
#include <string>

#include "base/result.h"

namespace opaline::daemon {

/// `opaline tradeoff`: what is passed on to opaline-tradeoff.
struct TradeoffWish {
  std::string directory;
  std::string out;  ///< empty: in the directory
  bool quick = false;
  double limit_seconds = 600.0;
};

/// Becomes `programs`/opaline-tradeoff, so that its terminal, Ctrl-C and exit status are ours: does not return, unless
/// it cannot. Errors: kUnavailable when the program is not there.
Error become_tradeoff(const std::filesystem::path& programs, const TradeoffWish& wish);

}  // namespace opaline::daemon
