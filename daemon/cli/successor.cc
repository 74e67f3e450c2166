#include "daemon/cli/successor.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

namespace opaline::daemon {

Error become(const std::filesystem::path& program, std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), program.string());
  std::vector<char*> words;
  words.reserve(arguments.size() + 1);
  for (std::string& argument : arguments) words.push_back(argument.data());
  words.push_back(nullptr);
  ::execv(words.front(), words.data());
  return unavailable(fmt::format("{}: {}; install all programs together",
                                 program.string(),
                                 std::generic_category().message(errno)));
}

}  // namespace opaline::daemon
