#include <cstdint>

#include "sim/photon_lanes.h"

namespace opaline::sim {
namespace portable {
namespace {
#include "sim/photon_step.inc"
}  // namespace
}  // namespace portable

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#pragma GCC push_options
#pragma GCC target("avx2")
namespace avx2 {
namespace {
#include "sim/photon_step.inc"
}  // namespace
}  // namespace avx2
#pragma GCC pop_options

StepFunction best_step_function() {
  return __builtin_cpu_supports("avx2") != 0 ? avx2::step : portable::step;
}
#else
StepFunction best_step_function() { return portable::step; }
#endif

StepFunction portable_step_function() { return portable::step; }

}  // namespace opaline::sim
