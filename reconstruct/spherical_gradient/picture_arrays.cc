#include "reconstruct/spherical_gradient/picture_arrays.h"

#include <sys/mman.h>

#include <memory>

namespace opaline::reconstruct {
namespace {

constexpr std::size_t kLargePage = std::size_t{2} << 20U;

/// What lies wholly within; a wish, so whether it is granted does not matter.
void wish_for_large_pages(float* values, std::size_t count) {
  void* begin = values;
  std::size_t bytes = count * sizeof(float);
  if (std::align(kLargePage, kLargePage, begin, bytes) == nullptr) return;
  madvise(begin, bytes / kLargePage * kLargePage, MADV_HUGEPAGE);
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
