#pragma once

#include <array>
#include <vector>

#include "render/solver/lanes.h"

namespace opaline::render {

/// A sum over many rows: every few hundred of them in T, those in double.
template <class T>
class RowTotal {
 public:
  using Sum = std::array<double, kLanes>;

  void add(const Lanes<T>& value) {
    part_ += value;
    if (++count_ == kRowsAPart) close();
  }
  Sum value() {
    close();
    return sum_;
  }

 private:
  static constexpr int kRowsAPart = 256;
  void close() {
    for (int lane = 0; lane < kLanes; ++lane) sum_[lane] += static_cast<double>(part_[lane]);
    part_ = Lanes<T>::zero();
    count_ = 0;
  }
  Lanes<T> part_ = Lanes<T>::zero();
  int count_ = 0;
  Sum sum_{};
};

/// The sum of what several threads found.
template <class T>
Lanes<T> total_of(const std::vector<std::array<double, kLanes>>& parts) {
  Lanes<T> total = Lanes<T>::zero();
  for (int lane = 0; lane < kLanes; ++lane) {
    double sum = 0.0;
    for (const auto& part : parts) sum += part[lane];
    total.set(lane, static_cast<T>(sum));
  }
  return total;
}

}  // namespace opaline::render
