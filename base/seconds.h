#pragma once

#include <chrono>

namespace opaline {

inline double seconds(std::chrono::nanoseconds time) {
  return std::chrono::duration<double>(time).count();
}

}  // namespace opaline
