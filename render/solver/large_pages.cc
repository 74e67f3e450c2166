#include "render/solver/large_pages.h"

#include <sys/mman.h>

#include <memory>

namespace opaline::render {

void prefer_large_pages(void* memory, std::size_t bytes) noexcept {
  constexpr std::size_t kLarge = std::size_t{1} << 21;
  void* first = memory;
  std::size_t left = bytes;
  if (std::align(kLarge, kLarge, first, left) == nullptr) return;
  madvise(first, left & ~(kLarge - 1), MADV_HUGEPAGE);
}

}  // namespace opaline::render
