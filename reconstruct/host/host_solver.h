#pragma once

#include <memory>

#include "reconstruct/diffusion/fluence_solver.h"
#include "reconstruct/diffusion/precision.h"

namespace opaline::reconstruct::host {

using diffusion::Precision;  ///< kHalf, kSingle, kDouble

/// How the processor is used.
struct HostOptions {
  int threads = 0;  ///< 0: one for every core
  diffusion::Precision precision = diffusion::Precision::kSingle;
};

/// "threads = -1; expected 0 (every core) to 1024"
Result<void> validate(const HostOptions& options);

/// Multigrid-preconditioned conjugate gradients (diffusion/conjugate_gradient.h) on the processor:
/// threads over slabs of the block, SIMD over right-hand sides, up to 16 of which share one sweep
/// over the coefficients. Half, single or double precision inside, float64 residuals outside, so
/// tolerances down to about 1e-12 are reached in each.
///
/// The result does not depend on the number of threads, bit for bit. Working memory is kept from
/// one solve to the next: about 20 bytes a cell and right-hand side of a group of 16 in single precision.
///
/// `options` must be valid.
std::unique_ptr<diffusion::FluenceSolver> make_host_solver(const HostOptions& options);

}  // namespace opaline::reconstruct::host
