#include "base/ensure.h"

#include <cstdlib>

#include "base/log.h"

namespace opaline {

void ensure_failed(const char* condition, const char* file, int line) {
  log::critical("broken invariant: {} at {}:{}", condition, file, line);
  std::abort();
}

}  // namespace opaline
