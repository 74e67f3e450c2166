#include "reconstruct/diffusion/reference_passes.h"

#include <algorithm>
#include <numeric>

namespace opaline::reconstruct::diffusion {
namespace {

double dot(const double* a, const double* b, std::size_t n) {
  return std::inner_product(a, a + n, b, 0.0);
}

template <class F>
void for_each_cell(const Level& level, F f) {
  std::size_t at = 0;
  for (int k = 0; k < level.cells[2]; ++k)
    for (int j = 0; j < level.cells[1]; ++j)
      for (int i = 0; i < level.cells[0]; ++i) f(at++, i, j, k);
}

/// Calls f(coarse cell, weight) for every aggregate that fine cell (i, j, k) takes its correction
/// from.
template <class F>
void for_each_source(
    const Level& fine, const Level& coarse, std::size_t at, int i, int j, int k, F f) {
  const std::array<int, 3> cell{i, j, k};
  std::size_t above = 0;
  for (int axis = 0; axis < 3; ++axis) above += cell[axis] / fine.ratio[axis] * coarse.stride(axis);
  double own = 1.0;
  for (int axis = 0; axis < 3; ++axis) {
    if (fine.ratio[axis] == 1) continue;
    const double weight = fine.transfer[axis][at];
    own -= weight;
    const bool forward = cell[axis] % 2 == 1;
    const int beside = cell[axis] / 2 + (forward ? 1 : -1);
    if (beside < 0 || beside >= coarse.cells[axis]) continue;
    f(forward ? above + coarse.stride(axis) : above - coarse.stride(axis), weight);
  }
  f(above, own);
}

}  // namespace

ReferencePasses::ReferencePasses(const std::vector<Level>& levels,
                                 const FieldBatch& b,
                                 FieldBatch& phi)
    : levels_(levels),
      b_(b),
      x_(phi),
      p_(b.cells, b.count),
      q_(b.cells, b.count),
      d_(b.cells, b.count),
      rho_(b.count, 0.0),
      rho_before_(b.count, 0.0),
      gamma_(b.count, 0.0),
      norms_(b.count, 0.0) {
  for (const Level& level : levels) {
    r_.emplace_back(level.cell_count(), b.count);
    z_.emplace_back(level.cell_count(), b.count);
  }
}

std::span<const double> ReferencePasses::true_residual() {
  for (std::size_t c = 0; c < x_.values.size(); ++c) x_.values[c] += d_.values[c];
  std::fill(d_.values.begin(), d_.values.end(), 0.0);
  for (int m = 0; m < b_.count; ++m) {
    double* r = r_[0].field(m);
    residual(levels_[0], b_.field(m), x_.field(m), r);
    norms_[m] = dot(r, r, b_.cells);
  }
  return norms_;
}

double ReferencePasses::neighbours(const Level& level, const double* u, int i, int j, int k) const {
  const std::array<int, 3> cell{i, j, k};
  const std::size_t at = i * level.stride(0) + j * level.stride(1) + k * level.stride(2);
  double sum = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    const std::size_t stride = level.stride(axis);
    const std::vector<double>& g = level.conductance[axis];
    if (cell[axis] > 0) sum += g[at - stride] * u[at - stride];
    if (cell[axis] + 1 < level.cells[axis]) sum += g[at] * u[at + stride];
  }
  return sum;
}

void ReferencePasses::sweep(int l, int m, bool red) {
  const Level& level = levels_[l];
  const double* r = r_[l].field(m);
  double* z = z_[l].field(m);
  for_each_cell(level, [&](std::size_t at, int i, int j, int k) {
    if (is_red(i, j, k) == red)
      z[at] = (r[at] + neighbours(level, z, i, j, k)) / level.diagonal[at];
  });
}

void ReferencePasses::smooth_restrict(int l) {
  const Level& level = levels_[l];
  const Level& coarse = levels_[l + 1];
  std::fill(r_[l + 1].values.begin(), r_[l + 1].values.end(), 0.0);
  for (int m = 0; m < b_.count; ++m) {
    double* z = z_[l].field(m);
    double* below = r_[l + 1].field(m);
    std::fill(z, z + level.cell_count(), 0.0);
    sweep(l, m, true);
    sweep(l, m, false);
    for_each_cell(level, [&](std::size_t at, int i, int j, int k) {
      if (!is_red(i, j, k)) return;
      const double left = neighbours(level, z, i, j, k);
      for_each_source(level, coarse, at, i, j, k, [&](std::size_t c, double weight) {
        below[c] += weight * left;
      });
    });
  }
}

void ReferencePasses::prolong_smooth(int l) {
  const Level& level = levels_[l];
  const bool last = l + 1 == levels();
  if (l == 0) rho_before_ = rho_;
  for (int m = 0; m < b_.count; ++m) {
    const double* r = r_[l].field(m);
    double* z = z_[l].field(m);
    for_each_cell(level, [&](std::size_t at, int i, int j, int k) {
      if (!is_red(i, j, k)) return;
      z[at] = r[at] / level.diagonal[at];
      if (last) return;
      const double* below = z_[l + 1].field(m);
      for_each_source(level, levels_[l + 1], at, i, j, k, [&](std::size_t c, double weight) {
        z[at] += weight * below[c];
      });
    });
    sweep(l, m, false);
    sweep(l, m, true);
    if (l == 0) rho_[m] = dot(r, z, b_.cells);
  }
}

void ReferencePasses::apply_dot(bool restart) {
  for (int m = 0; m < b_.count; ++m) {
    const double beta = restart || !(rho_before_[m] > 0.0) ? 0.0 : rho_[m] / rho_before_[m];
    const double* z = z_[0].field(m);
    double* p = p_.field(m);
    double* q = q_.field(m);
    for (std::size_t c = 0; c < b_.cells; ++c) p[c] = z[c] + beta * p[c];
    for_each_cell(levels_[0], [&](std::size_t at, int i, int j, int k) {
      q[at] = levels_[0].diagonal[at] * p[at] - neighbours(levels_[0], p, i, j, k);
    });
    gamma_[m] = dot(p, q, b_.cells);
  }
}

std::span<const double> ReferencePasses::update_norm() {
  for (int m = 0; m < b_.count; ++m) {
    const double alpha = gamma_[m] > 0.0 ? rho_[m] / gamma_[m] : 0.0;
    const double* p = p_.field(m);
    const double* q = q_.field(m);
    double* r = r_[0].field(m);
    double* d = d_.field(m);
    for (std::size_t c = 0; c < b_.cells; ++c) {
      d[c] += alpha * p[c];
      r[c] -= alpha * q[c];
    }
    norms_[m] = dot(r, r, b_.cells);
  }
  return norms_;
}

}  // namespace opaline::reconstruct::diffusion
