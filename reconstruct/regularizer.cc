#include "reconstruct/regularizer.h"

#include <algorithm>
#include <array>

namespace opaline::reconstruct {

Regularizer::Regularizer(const Block& block, double lambda)
    : block_(block),
      lambda_(lambda),
      length_(std::min({block.size().x, block.size().y, block.size().z})) {}

double Regularizer::add(std::span<const double> u, std::span<double> gradient) const {
  if (lambda_ == 0.0) return 0.0;
  return add_axis(0, u, gradient) + add_axis(1, u, gradient) + add_axis(2, u, gradient);
}

double Regularizer::add_axis(std::size_t axis,
                             std::span<const double> u,
                             std::span<double> gradient) const {
  const double h = block_.spacing()[axis];
  const double weight = lambda_ * block_.cell_volume() / (h * h * length_);
  const std::array<std::size_t, 3> offsets{
      1, static_cast<std::size_t>(block_.nx), static_cast<std::size_t>(block_.nx) * block_.ny};
  const std::size_t offset = offsets[axis];
  const int ni = block_.nx - (axis == 0 ? 1 : 0);
  const int nj = block_.ny - (axis == 1 ? 1 : 0);
  const int nk = block_.nz - (axis == 2 ? 1 : 0);
  double sum = 0.0;
  for (int k = 0; k < nk; ++k) {
    for (int j = 0; j < nj; ++j) {
      const std::size_t row = block_.index(0, j, k);
      for (std::size_t c = row; c < row + ni; ++c) {
        const double step = u[c] - u[c + offset];
        sum += step * step;
        gradient[c] += weight * step;
        gradient[c + offset] -= weight * step;
      }
    }
  }
  return 0.5 * weight * sum;
}

}  // namespace opaline::reconstruct
