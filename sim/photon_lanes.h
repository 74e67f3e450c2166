#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "sim/camera_connection.h"
#include "sim/light_transport.h"
#include "sim/light_transport_medium.h"

namespace opaline::sim {

inline constexpr int kLanes = 8;

/// SplitMix64 (Steele, Lea & Flood 2014): seeds the lanes and serves the rare events.
class SplitMix {
 public:
  explicit SplitMix(std::uint64_t state) : state_(state) {}
  std::uint64_t next() {
    state_ += 0x9e3779b97f4a7c15U;
    std::uint64_t z = state_;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9U;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebU;
    return z ^ (z >> 31);
  }
  /// In [0, 1).
  double uniform() { return static_cast<double>(next() >> 11) * 0x1p-53; }

 private:
  std::uint64_t state_;
};

/// What happened in a lane during a step, beyond flying on.
inline constexpr std::int32_t kAtBoundary = 1;
inline constexpr std::int32_t kSeen = 2;
inline constexpr std::int32_t kDim = 4;

inline constexpr float kDimWeight = 0.02F;  ///< below it Russian roulette decides

/// Eight photons, one a lane; structure of arrays, so that a step is vector arithmetic.
struct PhotonLanes {
  template <class T>
  struct alignas(32) Row : std::array<T, kLanes> {};
  std::array<Row<float>, 3> position;       ///< mm
  std::array<Row<float>, 3> direction;      ///< unit
  std::array<Row<float>, 3> arrived_along;  ///< direction before the last collision
  Row<float> weight;
  Row<float> absorbed;          ///< running sum
  Row<std::int32_t> scattered;  ///< -1 once scattered
  Row<std::int32_t> alive;      ///< -1 or 0
  Row<std::int32_t> event;
  std::array<Row<std::uint32_t>, 4>
      random;  ///< xoshiro128+ (Blackman & Vigna 2018), one generator a lane
};

/// What a step needs to know, in the units it computes with.
struct StepConstants {
  std::array<float, 3> size;
  std::array<float, 3> inverse_spacing;
  std::array<std::int32_t, 3> last_cell;
  std::int32_t stride_y;
  std::int32_t stride_z;
  float mean_free_path;  ///< 1 / majorant, mm
  float anisotropy;
  bool periodic_sides;
  const VoxelOptics* voxels;
};

/// One tentative flight of every living lane, ending at an accepted collision (scattered into a new
/// direction), at a rejected one, or beyond the boundary (then nothing moves and the event says
/// so). Bit l of what it returns is set when lane l has an event. Uses AVX2 where the processor has it; both give the
/// same results, bit by bit.
using StepFunction = unsigned (*)(const StepConstants&, PhotonLanes&);
StepFunction best_step_function();
StepFunction portable_step_function();

}  // namespace opaline::sim
