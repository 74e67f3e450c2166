#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "base/block.h"
#include "reconstruct/channel_problem.h"

namespace opaline::reconstruct {

/// Fields are rasters of n0 x n1 x n2, the first axis fastest; a face is one of thickness 1.
using Extent = std::array<int, 3>;

/// Multiplies a field along each axis in turn by that axis' matrix (rows: the new extent).
std::vector<double> multiply_along_axes(const Extent& extent,
                                        const std::array<Eigen::MatrixXd, 3>& matrices,
                                        std::vector<double> field);

/// Along one axis: the means over `coarse` equal cells of the values of `n`, coarse x n.
Eigen::MatrixXd cell_means(int n, int coarse);

/// The same box in fewer cells: as near to cubes as those of `block` allow, at most `most` of them.
Block coarser_block(const Block& block, std::size_t most);

/// Volume-weighted means over the cells of `coarse`; their faces need not fall on the block's.
std::vector<double> average_cells(const Block& block,
                                  const Block& coarse,
                                  std::vector<double> field);
/// Linear between the centres of the coarse cells, constant beyond the outer ones.
std::vector<double> interpolate_cells(const Block& coarse,
                                      const Block& block,
                                      std::vector<double> field);

/// The problem on a coarser grid: irradiances are means, data are means by weight, weights are sums,
/// as those of independent data.
ChannelProblem coarsen(const ChannelProblem& problem, const Block& coarse);

}  // namespace opaline::reconstruct
