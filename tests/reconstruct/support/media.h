#pragma once

#include <cmath>
#include <random>

#include "base/block.h"
#include "reconstruct/diffusion/fluence_solver.h"

namespace opaline::reconstruct::diffusion::testing {

/// Every cell drawn alone: kappa log-uniform in [1 / contrast, 1] mm, sigma_a log-uniform in [1e-3,
/// 1e-1] per mm.
inline Medium random_medium(const Block& block, double contrast, unsigned seed) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  Medium medium{block, {}, {}, 2.34053};
  for (std::size_t c = 0; c < block.cell_count(); ++c) {
    medium.diffusion.push_back(std::pow(contrast, -uniform(generator)));
    medium.absorption.push_back(1e-3 * std::pow(100.0, uniform(generator)));
  }
  return medium;
}

/// Values in [0, 1], all cells.
inline FieldBatch random_fields(const Block& block, int count, unsigned seed) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  FieldBatch fields(block.cell_count(), count);
  for (double& v : fields.values) v = uniform(generator);
  return fields;
}

/// ||a - b|| / ||b||, the worst field's.
inline double worst_difference(const FieldBatch& a, const FieldBatch& b) {
  double worst = 0.0;
  for (int m = 0; m < b.count; ++m) {
    double above = 0.0;
    double below = 0.0;
    for (std::size_t c = 0; c < b.cells; ++c) {
      above += (a.field(m)[c] - b.field(m)[c]) * (a.field(m)[c] - b.field(m)[c]);
      below += b.field(m)[c] * b.field(m)[c];
    }
    worst = std::max(worst, std::sqrt(above / below));
  }
  return worst;
}

}  // namespace opaline::reconstruct::diffusion::testing
