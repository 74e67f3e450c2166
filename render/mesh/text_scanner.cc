#include "render/mesh/text_scanner.h"

#include <fmt/format.h>

namespace opaline::render {

Error TextScanner::expected(std::string_view what, std::string_view found) const {
  if (found.empty())
    return invalid_argument(fmt::format("line {}: ends where {} should be", line_, what));
  return invalid_argument(
      fmt::format("line {}: expected {}, found \"{}\"", line_, what, found.substr(0, 40)));
}

}  // namespace opaline::render
