#pragma once

#include <array>
#include <cstddef>

namespace opaline::reconstruct::diffusion {

/// Gauss-Legendre nodes and weights on [-1, 1], 8 points (Abramowitz & Stegun, table 25.4), positive half.
inline constexpr std::array kGaussNodes{
    0.1834346424956498, 0.5255324099163290, 0.7966664774136267, 0.9602898564975363};
inline constexpr std::array kGaussWeights{
    0.3626837833783620, 0.3137066458778873, 0.2223810344533745, 0.1012285362903763};

/// Calls f(x, weight) for the nodes of `panels` equal panels of 8 points on [0, 1].
template <class Function>
void for_gauss_nodes(int panels, const Function& f) {
  const double half = 0.5 / panels;
  for (int panel = 0; panel < panels; ++panel) {
    const double middle = (2 * panel + 1) * half;
    for (std::size_t n = 0; n < kGaussNodes.size(); ++n) {
      f(middle - half * kGaussNodes[n], half * kGaussWeights[n]);
      f(middle + half * kGaussNodes[n], half * kGaussWeights[n]);
    }
  }
}

}  // namespace opaline::reconstruct::diffusion
