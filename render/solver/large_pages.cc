#include "render/solver/large_pages.h"

#include <sys/mman.h>

#include <cstdint>

namespace opaline::render {

void prefer_large_pages(const void* memory, std::size_t bytes) noexcept {
  constexpr std::uintptr_t kLarge = std::uintptr_t{1} << 21;
  const auto first = (reinterpret_cast<std::uintptr_t>(memory) + kLarge - 1) & ~(kLarge - 1);
  const auto last = (reinterpret_cast<std::uintptr_t>(memory) + bytes) & ~(kLarge - 1);
  if (first >= last) return;
  madvise(reinterpret_cast<void*>(first), last - first, MADV_HUGEPAGE);
}

}  // namespace opaline::render
