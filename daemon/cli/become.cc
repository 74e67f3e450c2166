#include "daemon/cli/become.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

namespace opaline::daemon {

Error become(const std::filesystem::path& programs,
             const std::string& name,
             const std::vector<std::string>& arguments) {
  std::vector<std::string> words{(programs / name).string()};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> pointers;
  pointers.reserve(words.size() + 1);
  for (std::string& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  ::execv(pointers.front(), pointers.data());
  return unavailable(fmt::format("{}: {}; install all programs together",
                                 words.front(),
                                 std::generic_category().message(errno)));
}

}  // namespace opaline::daemon
