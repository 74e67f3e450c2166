#pragma once

#include "base/result.h"
#include "reconstruct/diffusion/fluence_solver.h"

namespace opaline::reconstruct::diffusion {

/// Errors: kInvalidArgument naming the first cell whose diffusion is not positive and finite or
/// whose absorption is negative or not finite, or the shape that does not fit.
Result<void> validate(const Medium& medium);

/// Errors: kInvalidArgument when tolerance or max_iterations is out of range.
Result<void> validate(const SolveOptions& options);

/// Checks what a solve is given against the block it was prepared for.
/// Errors: kInvalidArgument naming the shape that does not fit.
Result<void> check_shapes(const Block& block, const FieldBatch& b, const FieldBatch& phi);

/// check_shapes, and that every value is finite.
/// Errors: kInvalidArgument naming the field and the cell.
Result<void> check_fields(const Block& block, const FieldBatch& b, const FieldBatch& phi);

}  // namespace opaline::reconstruct::diffusion
