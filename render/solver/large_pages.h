#pragma once

#include <cstddef>
#include <vector>

namespace opaline::render {

/// Asks the system to keep this memory in pages of 2 MiB (Linux: madvise(MADV_HUGEPAGE)), which counts where nothing has been
/// written there yet; elsewhere nothing happens. A solver goes through all of its memory many times, and looks up where its
/// pages are in a table that holds about a thousand of them: 4 to 8 MiB of small pages.
void prefer_large_pages(void* memory, std::size_t bytes) noexcept;

/// The same for the room that a vector takes next.
template <class T>
void reserve_large(std::vector<T>& vector, std::size_t count) {
  if (vector.capacity() >= count) return;
  vector.reserve(count);
  prefer_large_pages(vector.data(), vector.capacity() * sizeof(T));
}

/// So many values, in such pages.
template <class T>
std::vector<T> large_vector(std::size_t count, const T& value) {
  std::vector<T> vector;
  reserve_large(vector, count);
  vector.resize(count, value);
  return vector;
}

}  // namespace opaline::render
