#include "daemon/token_file.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include "base/files.h"

namespace opaline::daemon {
namespace {

constexpr std::size_t kLimit = 4096;
constexpr std::size_t kShortest = 16;

}  // namespace

Result<std::string> read_token(const std::filesystem::path& file) {
  const Result<std::string> text = read_text(file, kLimit);
  if (!text) return text.error();
  struct stat status {};
  if (::stat(file.c_str(), &status) != 0 || (status.st_mode & (S_IRWXO | S_IWGRP)) != 0) {
    return invalid_argument(fmt::format(
        "{0}: others can read the token or change it; expected \"chmod 600 {0}\"", file.string()));
  }
  std::string token = text->substr(0, text->find_first_of("\r\n"));
  if (token.size() >= kShortest) return token;
  return invalid_argument(
      fmt::format("{}: a token has {} characters or more", file.string(), kShortest));
}

}  // namespace opaline::daemon
