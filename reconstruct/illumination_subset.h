#pragma once

#include <cstddef>
#include <vector>

#include "reconstruct/channel_problem.h"

namespace opaline::reconstruct {

/// The same problem under some of its illuminations; data and noise counted again.
ChannelProblem with_illuminations(const ChannelProblem& problem,
                                  const std::vector<std::size_t>& chosen);

/// At most `count` (>= 2) of those that have data, spread evenly over all of them, the first and the last among them.
std::vector<std::size_t> few_illuminations(const ChannelProblem& problem, std::size_t count);

/// A problem cut in two by illuminations.
struct ValidationSplit {
  ChannelProblem fit;
  ChannelProblem held_out;  ///< may have no data
};
/// Keeps every fourth illumination that has data from the fit, at least one; none of fewer than three.
ValidationSplit split_for_validation(const ChannelProblem& problem);

}  // namespace opaline::reconstruct
