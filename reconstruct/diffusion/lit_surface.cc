#include "reconstruct/diffusion/lit_surface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "base/ensure.h"
#include "reconstruct/diffusion/half_space.h"

namespace opaline::reconstruct::diffusion {
namespace {

constexpr double kDeepest =
    30.0;  // mean free paths that are solved; below, the discrete field decays by a constant
constexpr std::size_t kMostCells = 4096;
constexpr int kNodes = 9;  // of the table, in each of its variables

/// The medium just under a face cell.
struct Under {
  double t = 0.0;       // h sigma_t'
  double albedo = 0.0;  // alpha'
  double cosine = 1.0;  // mu_i
};

/// Averages over e^(-2 tau), the way in and out.
Under under(const Medium& medium, std::size_t cell, std::ptrdiff_t inwards, int depth, double h) {
  double left = 1.0;
  double extinction = 0.0;
  double absorption = 0.0;
  for (int n = 0; n < depth; ++n, cell += inwards) {
    const double sigma_t = 1.0 / (3.0 * medium.diffusion[cell]);
    const double share = n + 1 == depth ? left : -left * std::expm1(-2.0 * h * sigma_t);
    extinction += share * sigma_t;
    absorption += share * medium.absorption[cell];
    left -= share;
  }
  return {h * extinction, 1.0 - absorption / extinction, 1.0};
}

/// Phi_D: diffusion in cells of t mean free paths, sigma_t' = 1, one column, q = 1.
double seen_of_diffusion(const Under& u, const Boundary& boundary) {
  const double kappa = 1.0 / 3.0;
  const double absorption = std::max(1e-9, 1.0 - u.albedo);
  const auto cells =
      std::clamp<std::size_t>(static_cast<std::size_t>(std::ceil(kDeepest / u.t)), 4, kMostCells);
  Medium column;
  column.block = {1, 1, static_cast<int>(cells), u.t, u.t, u.t};
  column.diffusion.assign(cells, kappa);
  column.absorption.assign(cells, absorption);
  column.boundary_a = boundary.a;
  const double area = u.t * u.t;
  std::vector<double> phi(cells, 0.0);
  const std::array<double, 1> unit{1.0};
  const FaceSource source(column, boundary, Face::kZMin, {});
  source.deposit(unit, phi);
  const double link = area * kappa / u.t;
  const double half_step = 0.5 * absorption * u.t * u.t / kappa;
  const double decay = 1.0 + half_step - std::sqrt(half_step * (half_step + 2.0));
  std::vector<double> factor(cells, 0.0);
  double before = 0.0;
  for (std::size_t n = 0; n < cells; ++n) {
    const double up = n == 0 ? area * boundary.conductance(u.t, kappa) : link * (1.0 - before);
    const double down = n + 1 == cells ? link * (1.0 - decay) : link;
    const double pivot = up + down + area * u.t * absorption;
    phi[n] = (phi[n] + (n == 0 ? 0.0 : link * phi[n - 1])) / pivot;
    factor[n] = before = link / pivot;
  }
  for (std::size_t n = cells - 1; n > 0; --n) phi[n - 1] += factor[n - 1] * phi[n];
  const std::array<CameraRay, 1> ray{CameraRay{0.0, 0.0, 1.0 / u.cosine}};
  std::array<double, 1> seen{};
  CameraRays(column, boundary, Face::kZMin, ray).gather(phi.data(), {}, seen);
  return seen[0] + (2.0 * boundary.a + 3.0 * u.cosine) * source.surface_terms(unit).escape[0];
}

struct Axis {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();

  void include(double value) {
    low = std::min(low, value);
    high = std::max(high, value);
  }
  int nodes() const { return high - low > 1e-9 * std::abs(high) ? kNodes : 1; }
  double node(int n) const { return nodes() == 1 ? low : low + (high - low) * n / (kNodes - 1); }
  /// The node below and how far beyond it.
  std::pair<int, double> place(double value) const {
    if (nodes() == 1) return {0, 0.0};
    const double at = std::clamp((value - low) / (high - low), 0.0, 1.0) * (kNodes - 1);
    const int below = std::min(static_cast<int>(at), kNodes - 2);
    return {below, at - below};
  }
};

/// Phi_T - Phi_D, linear between nodes in log t, log (1 - alpha') and mu_i.
class Table {
 public:
  Table(const std::vector<Under>& cells, const Boundary& boundary, double ior) {
    for (const Under& u : cells) {
      const auto x = variables(u);
      for (std::size_t axis = 0; axis < 3; ++axis) axes_[axis].include(x[axis]);
    }
    const HalfSpace half_space(ior);
    for (int a = 0; a < axes_[1].nodes(); ++a)
      for (int m = 0; m < axes_[2].nodes(); ++m) {
        Under u{0.0, 1.0 - std::exp(axes_[1].node(a)), axes_[2].node(m)};
        const double exact = half_space.emergent(u.albedo, u.cosine);
        for (int t = 0; t < axes_[0].nodes(); ++t) {
          u.t = std::exp(axes_[0].node(t));
          values_.push_back(exact - seen_of_diffusion(u, boundary));
        }
      }
  }

  double at(const Under& u) const {
    const auto x = variables(u);
    std::array<std::pair<int, double>, 3> places;
    for (std::size_t axis = 0; axis < 3; ++axis) places[axis] = axes_[axis].place(x[axis]);
    double sum = 0.0;
    for (unsigned corner = 0; corner < 8; ++corner) {
      double weight = 1.0;
      std::array<int, 3> node{};
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const int upper = static_cast<int>((corner >> axis) & 1U);
        weight *= upper != 0 ? places[axis].second : 1.0 - places[axis].second;
        node[axis] = std::min(places[axis].first + upper, axes_[axis].nodes() - 1);
      }
      sum += weight * values_[static_cast<std::size_t>(
                          (node[1] * axes_[2].nodes() + node[2]) * axes_[0].nodes() + node[0])];
    }
    return sum;
  }

 private:
  static std::array<double, 3> variables(const Under& u) {
    return {std::log(u.t), std::log(std::clamp(1.0 - u.albedo, 1e-9, 0.99)), u.cosine};
  }

  std::array<Axis, 3> axes_;
  std::vector<double> values_;
};

}  // namespace

std::vector<double> lit_surface(const Medium& medium,
                                const Boundary& boundary,
                                double ior,
                                Face face,
                                std::span<const CameraRay> rays,
                                std::span<const double> q) {
  const Block& block = medium.block;
  ENSURE(rays.size() == block.face_cell_count(face) && q.size() == rays.size());
  const int axis = axis_of(face);
  const std::array<std::ptrdiff_t, 3> strides{
      1, block.nx, static_cast<std::ptrdiff_t>(block.nx) * block.ny};
  const std::ptrdiff_t inwards = is_max(face) ? -strides[axis] : strides[axis];
  std::vector<Under> cells;
  cells.reserve(q.size());
  for (int row = 0; row < block.face_height(face); ++row) {
    for (int column = 0; column < block.face_width(face); ++column) {
      Under u = under(medium,
                      block.cell_behind(face, column, row),
                      inwards,
                      block.cells()[axis],
                      block.spacing()[axis]);
      u.cosine = 1.0 / rays[cells.size()].stretch;
      cells.push_back(u);
    }
  }
  const Table table(cells, boundary, ior);
  std::vector<double> seen(q.size(), 0.0);
  for (std::size_t x = 0; x < q.size(); ++x)
    if (q[x] > 0.0) seen[x] = q[x] * table.at(cells[x]);
  return seen;
}

}  // namespace opaline::reconstruct::diffusion
