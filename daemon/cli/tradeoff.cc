#include "daemon/cli/tradeoff.h"

#include <fmt/format.h>

#include <vector>

#include "daemon/cli/become.h"

namespace opaline::daemon {

Error become_tradeoff(const std::filesystem::path& programs, const TradeoffWish& wish) {
  std::vector<std::string> words{"--limit", fmt::format("{}", wish.limit_seconds)};
  if (!wish.out.empty()) words.insert(words.end(), {"--out", wish.out});
  if (wish.quick) words.emplace_back("--quick");
  words.insert(words.end(), {"--", wish.directory});
  return become(programs, "opaline-tradeoff", words);
}

}  // namespace opaline::daemon
