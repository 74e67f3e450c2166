#pragma once

#include "base/dataset.h"
#include "base/material.h"
#include "base/result.h"

namespace opaline::reconstruct {

/// The same box in cells `step` times as large along each axis, to the nearest number of cells, at least one.
Block coarser(const Block& block, double step);

/// The pictures on the faces of another block of the same size: means over the area of each of its cells. A radiance is
/// the mean of the usable part, and usable when that is half of the cell; with a share a_i of each fine cell,
///
///   L = sum a_i L_i / sum a_i,    var = sum a_i^2 var_i / (sum a_i)^2
///
/// as of independent data: two coarse cells that share a fine one are not, a little, when `block` does not divide evenly.
Dataset on_grid(const Dataset& dataset, const Block& block);

/// The coefficients at the cell centres of another block of the same size: trilinear in the logarithm, which keeps them
/// positive and a homogeneous material as it is. Meant for finer blocks: a coarser one would miss cells.
Material on_grid(const Material& material, const Block& block);

/// The regions of the fit put together to n x n, by where on the lit face their light lies: light adds up, so the
/// radiance under two regions at once is the sum of both, and so is the variance. A cell is usable when it is under
/// every region of the sum; a region without a usable cell is left out of its sum. Held-out lights stay as they are, and
/// so does a dataset of no more than n x n regions.
/// A camera that lights the larger region at once sees it with less noise than this sum.
/// Errors: kInvalidArgument for n < 1.
Result<Dataset> with_regions(const Dataset& dataset, int n);

}  // namespace opaline::reconstruct
