#include "reconstruct/regularizer.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace opaline::reconstruct {

Regularizer::Regularizer(const Block& block, double lambda, Smoothness kind)
    : block_(block),
      lambda_(lambda),
      length_(std::min({block.size().x, block.size().y, block.size().z})),
      kind_(kind) {}

// Calls visit(cell, neighbour, 1 / h^2) for every inner face.
template <class Visit>
void Regularizer::for_faces(Visit visit) const {
  const std::array<std::size_t, 3> offsets{
      1, static_cast<std::size_t>(block_.nx), static_cast<std::size_t>(block_.nx) * block_.ny};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double h = block_.spacing()[axis];
    const double scale = 1.0 / (h * h);
    const int ni = block_.nx - (axis == 0 ? 1 : 0);
    const int nj = block_.ny - (axis == 1 ? 1 : 0);
    const int nk = block_.nz - (axis == 2 ? 1 : 0);
    for (int k = 0; k < nk; ++k) {
      for (int j = 0; j < nj; ++j) {
        const std::size_t row = block_.index(0, j, k);
        for (std::size_t c = row; c < row + ni; ++c) visit(c, c + offsets[axis], scale);
      }
    }
  }
}

std::vector<double> Regularizer::squared_gradient(std::span<const double> u) const {
  std::vector<double> squares(u.size(), 0.0);
  for_faces([&](std::size_t i, std::size_t j, double scale) {
    const double share = 0.5 * scale * (u[i] - u[j]) * (u[i] - u[j]);
    squares[i] += share;
    squares[j] += share;
  });
  return squares;
}

// Half of 1 / sqrt(1 + |grad u|^2 / e^2) of each cell: a face has its two cells' sum.
std::vector<double> Regularizer::face_weights(std::span<const double> u) const {
  if (kind_ == Smoothness::kH1) return {};
  std::vector<double> weights = squared_gradient(u);
  const double edge = kEdge / length_;
  for (double& w : weights) w = 0.5 / std::sqrt(1.0 + w / (edge * edge));
  return weights;
}

double Regularizer::add(std::span<const double> u, std::span<double> gradient) const {
  if (lambda_ == 0.0) return 0.0;
  add_product(u, u, gradient);  // R'(u) = H(u) u for both kinds
  const double scale = lambda_ * block_.cell_volume() / length_;
  const double edge = kEdge / length_;
  double sum = 0.0;
  for (const double square : squared_gradient(u)) {
    sum += kind_ == Smoothness::kH1 ? 0.5 * square
                                    : square / (1.0 + std::sqrt(1.0 + square / (edge * edge)));
  }
  return scale * sum;
}

void Regularizer::add_product(std::span<const double> u,
                              std::span<const double> v,
                              std::span<double> out) const {
  if (lambda_ == 0.0) return;
  const double scale = lambda_ * block_.cell_volume() / length_;
  const std::vector<double> weights = face_weights(u);
  for_faces([&](std::size_t i, std::size_t j, double by) {
    const double weight = weights.empty() ? 1.0 : weights[i] + weights[j];
    const double step = scale * by * weight * (v[i] - v[j]);
    out[i] += step;
    out[j] -= step;
  });
}

void Regularizer::add_diagonal(std::span<const double> u, std::span<double> out) const {
  if (lambda_ == 0.0) return;
  const double scale = lambda_ * block_.cell_volume() / length_;
  const std::vector<double> weights = face_weights(u);
  for_faces([&](std::size_t i, std::size_t j, double by) {
    const double weight = weights.empty() ? 1.0 : weights[i] + weights[j];
    out[i] += scale * by * weight;
    out[j] += scale * by * weight;
  });
}

}  // namespace opaline::reconstruct
