#pragma once

#include <vector>

namespace opaline::reconstruct {

/// An objective of one channel at one point, with its gradient.
struct Evaluation {
  double value = 0.0;            ///< J
  double chi_squared = 0.0;      ///< sum w (L - L*)^2, twice the data term
  double regularization = 0.0;   ///< J less the data term
  std::vector<double> gradient;  ///< dJ/dp
};

}  // namespace opaline::reconstruct
