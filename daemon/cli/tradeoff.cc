#include "daemon/cli/tradeoff.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>
#include <vector>

namespace opaline::daemon {

Error become_tradeoff(const std::filesystem::path& programs, const TradeoffWish& wish) {
  std::vector<std::string> words{
      (programs / "opaline-tradeoff").string(), "--limit", fmt::format("{}", wish.limit_seconds)};
  if (!wish.out.empty()) words.insert(words.end(), {"--out", wish.out});
  if (wish.quick) words.emplace_back("--quick");
  words.insert(words.end(), {"--", wish.directory});
  std::vector<char*> arguments;
  arguments.reserve(words.size() + 1);
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  ::execv(arguments.front(), arguments.data());
  return unavailable(fmt::format("{}: {}; install all programs together",
                                 words.front(),
                                 std::generic_category().message(errno)));
}

}  // namespace opaline::daemon
