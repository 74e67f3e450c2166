#pragma once

#include <memory>

#include "reconstruct/diffusion/fluence_solver.h"

namespace opaline::reconstruct::diffusion {

/// Multigrid-preconditioned conjugate gradients as plain loops in double precision, for tests and
/// small blocks.
std::unique_ptr<FluenceSolver> make_reference_solver();

/// ||b||^2 of each field; sets phi to zero where b is, since there the answer is known.
std::vector<double> norms_and_trivial(const FieldBatch& b, FieldBatch& phi);

}  // namespace opaline::reconstruct::diffusion
