#pragma once

#include <optional>
#include <span>
#include <vector>

#include "base/block.h"
#include "reconstruct/channel_problem.h"

namespace opaline::reconstruct {

/// The same block in about half as many cells along every axis whose cells are no longer than 1.5 times the shortest:
/// ceil(n / 2) of them, so cells need not lie whole in one coarse cell. None where an axis would be left with fewer
/// than four cells: so coarse a grid says little of the finer one.
std::optional<Block> coarser_block(const Block& block);

/// A channel's problem on a coarser grid of the same block. Irradiance, radiance and camera are means over the area of
/// each coarse face cell, of the usable data; weights are sums of w times the share of the fine cell, so that chi^2
/// keeps its size beside the regulariser, which is an integral. The averaging's gain in noise is not counted: the
/// coarse grid's own error is larger.
ChannelProblem coarsened(const ChannelProblem& problem, const Block& coarse);

/// As many solves on `fine` as cost what `solves` on `coarse` do, by their cells, rounded up.
long solves_on_finer(const Block& coarse, const Block& fine, long solves);

/// Means over the volume of each cell of `to` of values on the cells of `from`, a grid of the same block.
std::vector<double> restricted(const Block& from, const Block& to, std::span<const double> values);

/// Trilinear between cell centres, constant beyond the outermost: from coarse cells to finer ones of the same block.
std::vector<double> prolonged(const Block& from, const Block& to, std::span<const double> values);

}  // namespace opaline::reconstruct
