#pragma once

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

#include <cstddef>

#include "render/solver/lanes.h"

namespace opaline::render {

/// Writes a field from one end to the other. A field of more than 8 MiB, of which caches would keep nothing until it is read
/// again, is written past them where the processor can (x86: streaming stores), which spares reading each line before it is
/// overwritten: of the 770 bytes that an iteration moves a node that is a tenth.
///
/// Threads: each writes rows of its own, and others may read those after it has called finish_writing().
template <class T>
class FieldWriter {
 public:
  FieldWriter(Lanes<T>* field, std::size_t rows)
      : field_(field), past_(rows * sizeof(Lanes<T>) > (std::size_t{8} << 20)) {}

  void put(int row, const Lanes<T>& value) const {
#if defined(__SSE2__)
    if (past_) {
      stream(reinterpret_cast<T*>(&field_[row]), value);
      return;
    }
#endif
    field_[row] = value;
  }

 private:
#if defined(__SSE2__)
  static void stream(float* to, const Lanes<float>& value) {
    _mm_stream_ps(to, reinterpret_cast<const __m128&>(value.part[0]));
  }
  static void stream(double* to, const Lanes<double>& value) {
    for (int r = 0; r < Lanes<double>::kRegisters; ++r) {
      _mm_stream_pd(to + static_cast<std::ptrdiff_t>(r) * Lanes<double>::kWidth,
                    reinterpret_cast<const __m128d&>(value.part[r]));
    }
  }
#endif
  Lanes<T>* field_;
  bool past_;
};

inline void finish_writing() {
#if defined(__SSE2__)
  _mm_sfence();
#endif
}

}  // namespace opaline::render
