#pragma once

#include <sys/mman.h>

#include <cstddef>
#include <utility>

#include "base/ensure.h"

namespace opaline::reconstruct::host {

/// Zeroed numbers in pages of their own: page-aligned, in huge pages where the system has them.
template <class T>
class Buffer {
 public:
  Buffer() = default;
  explicit Buffer(std::size_t count) : bytes_(count * sizeof(T)) {
    if (bytes_ == 0) return;
    void* at = mmap(nullptr, bytes_, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    ENSURE(at != MAP_FAILED);  // out of memory ends the process
    madvise(at, bytes_, MADV_HUGEPAGE);
    data_ = static_cast<T*>(at);
  }
  ~Buffer() {
    if (data_ != nullptr) munmap(data_, bytes_);
  }
  Buffer(Buffer&& other) noexcept
      : data_(std::exchange(other.data_, nullptr)), bytes_(std::exchange(other.bytes_, 0)) {}
  Buffer& operator=(Buffer&& other) noexcept {
    std::swap(data_, other.data_);
    std::swap(bytes_, other.bytes_);
    return *this;
  }

  T* data() { return data_; }
  const T* data() const { return data_; }
  std::size_t size() const { return bytes_ / sizeof(T); }

 private:
  T* data_ = nullptr;
  std::size_t bytes_ = 0;
};

}  // namespace opaline::reconstruct::host
