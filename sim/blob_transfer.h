#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <stop_token>
#include <vector>

#include "base/result.h"
#include "base/thread_team.h"
#include "sim/blob_walk.h"

namespace opaline::sim {

inline constexpr int kTransferDegree = 8;
inline constexpr std::size_t kTransferTerms =
    static_cast<std::size_t>((kTransferDegree + 1) * (kTransferDegree + 1));

/// Real, orthonormal spherical harmonics to degree 8 at a unit vector, l (l + 1) + m at a time: Y_00 = 1/sqrt(4 pi), Y_1 = sqrt(3/(4 pi)) (y, z, x).
std::array<double, kTransferTerms> harmonics(Vec3 unit);

/// A place of a body's surface that a camera sees.
struct SeenPlace {
  Vec3 point;
  Vec3 normal;
  Vec3 to_camera;
};

/// One place's radiance towards the camera under any light from a sphere around it: that under power per solid angle and over the sphere's
/// squared radius sum_lm L_lm Y_lm(direction of the lamp from the middle) is sum_lm t_lm L_lm; precomputed radiance transfer (Sloan et al. 2002), so a lamp
/// of intensity I in direction u gives I/d^2 sum_lm t_lm Y_lm(u).
struct BlobTransfer {
  std::array<float, kTransferTerms> terms{};
  float variance = 0.0F;  ///< of t_00: the paths' noise
};

struct TransferSize {
  std::int64_t paths = 256;  ///< of each place; >= 16
  double stage_mm = 0.0;     ///< radius of the sphere of lights; 0: far away
};

/// BlobWalk's paths, each where it meets the sphere of lights. Deterministic in `seed`, whatever the threads. `progress` is told a share, from one thread.
/// Errors: kInvalidArgument, kCancelled.
Result<std::vector<BlobTransfer>> trace_transfer(const Blob& blob,
                                                 const BlobMaterial& material,
                                                 std::span<const SeenPlace> places,
                                                 const TransferSize& size,
                                                 std::uint64_t seed,
                                                 ThreadTeam& team,
                                                 const std::function<void(double)>& progress,
                                                 std::stop_token stop);

/// Quadratic surfaces fitted to what lies within `reach_mm` of each place with a like normal, over its tangent plane: less noise, no bias to third order, where planes would make
/// gradients on a ball too small by reach^2/(4 R^2). `columns`
/// and `pixel_of` say where places lie in the picture, at most `half` pixels apart.
std::vector<BlobTransfer> smoothed(std::span<const BlobTransfer> transfer,
                                   std::span<const SeenPlace> places,
                                   std::span<const std::uint32_t> pixel_of,
                                   int columns,
                                   int half,
                                   double reach_mm,
                                   ThreadTeam& team);

}  // namespace opaline::sim
