#pragma once

#include <cstdint>
#include <memory>
#include <string_view>

#include "reconstruct/diffusion/fluence_solver.h"

namespace opaline::reconstruct::host {

/// How numbers are held between the residuals, which are always in float64.
enum class Precision : std::uint8_t {
  kHalf,    ///< the multigrid's corrections in binary16, all else and all arithmetic in single
  kSingle,  ///< float32
  kDouble,  ///< float64, twice the memory
};
std::string_view to_string(Precision precision);  ///< "half" | "single" | "double"

/// How the processor is used.
struct HostOptions {
  int threads = 0;  ///< 0: one for every core
  Precision precision = Precision::kSingle;
};

/// "threads = -1; expected 0 (every core) to 1024"
Result<void> validate(const HostOptions& options);

/// Multigrid-preconditioned conjugate gradients (diffusion/conjugate_gradient.h) on the processor:
/// threads over slabs of the block, SIMD over right-hand sides, up to 16 of which share one sweep
/// over the coefficients. Half, single or double precision inside, float64 residuals outside, so
/// tolerances down to about 1e-12 are reached in each.
///
/// The result does not depend on the number of threads, bit for bit. Working memory is kept from
/// one solve to the next: about 18 bytes a cell and right-hand side of a group of 16 in single precision.
///
/// `options` must be valid.
std::unique_ptr<diffusion::FluenceSolver> make_host_solver(const HostOptions& options);

}  // namespace opaline::reconstruct::host
