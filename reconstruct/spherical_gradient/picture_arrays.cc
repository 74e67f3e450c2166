#include "reconstruct/spherical_gradient/picture_arrays.h"

#include <sys/mman.h>

#include <cstdint>

namespace opaline::reconstruct {
namespace {

constexpr std::uintptr_t kLargePage = 2U << 20U;

/// What lies wholly within; a wish, so whether it is granted does not matter.
void wish_for_large_pages(const float* begin, std::size_t count) {
  const auto first = reinterpret_cast<std::uintptr_t>(begin);
  const std::uintptr_t from = (first + kLargePage - 1) / kLargePage * kLargePage;
  const std::uintptr_t to = (first + count * sizeof(float)) / kLargePage * kLargePage;
  if (from < to) madvise(reinterpret_cast<void*>(from), to - from, MADV_HUGEPAGE);
}

}  // namespace

void assign_zeros(std::initializer_list<std::vector<float>*> vectors,
                  std::size_t count,
                  ThreadTeam& team) {
  team.run([&](int thread) {
    for (std::size_t n = static_cast<std::size_t>(thread); n < vectors.size();
         n += static_cast<std::size_t>(team.size())) {
      std::vector<float>& values = *vectors.begin()[n];
      values.clear();
      values.reserve(count);
      wish_for_large_pages(values.data(), count);
      values.assign(count, 0.0F);
    }
  });
}

}  // namespace opaline::reconstruct
