#include "bench/inverse/element_solver.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace opaline::bench {
namespace {

constexpr std::size_t kWidth = kElementFields;
constexpr int kMaxIterations = 200;
constexpr int kCoarsestSweeps = 20;
using Scalars = std::array<double, kWidth>;

// Eight right-hand sides; the compiler makes of it what the processor has.
using Lanes = double __attribute__((vector_size(kWidth * sizeof(double)), aligned(8)));

#define OPALINE_CLONES __attribute__((target_clones("avx512f", "avx2", "default")))

struct Offsets {
  std::array<std::ptrdiff_t, 27> at{};  // in values
};

Offsets offsets_of(const ElementMesh& mesh) {
  Offsets offsets;
  const auto row = static_cast<std::ptrdiff_t>(mesh.axes[0].nodes());
  const auto plane = row * static_cast<std::ptrdiff_t>(mesh.axes[1].nodes());
  for (std::ptrdiff_t n = 0; n < 27; ++n)
    offsets.at[static_cast<std::size_t>(n)] =
        ((n / 9 - 1) * plane + (n / 3 % 3 - 1) * row + n % 3 - 1) *
        static_cast<std::ptrdiff_t>(kWidth);
  return offsets;
}

// out = b - K x at every node; b may be null: out = K x.
OPALINE_CLONES void residual(const double* stencil,
                             const Offsets& offsets,
                             std::size_t nodes,
                             const double* b,
                             const double* x,
                             double* out) {
  for (std::size_t n = 0; n < nodes; ++n, stencil += 27, x += kWidth, out += kWidth) {
    Lanes sums[3] = {};
    for (std::size_t s = 0; s < 27; ++s)
      sums[s % 3] += stencil[s] * *reinterpret_cast<const Lanes*>(x + offsets.at[s]);
    const Lanes kx = sums[0] + sums[1] + sums[2];
    if (b == nullptr) {
      *reinterpret_cast<Lanes*>(out) = kx;
    } else {
      *reinterpret_cast<Lanes*>(out) = *reinterpret_cast<const Lanes*>(b + n * kWidth) - kx;
    }
  }
}

// One Gauss-Seidel sweep, through the nodes in order or against it.
OPALINE_CLONES void sweep(const double* stencil,
                          const Offsets& offsets,
                          std::size_t nodes,
                          const double* b,
                          double* x,
                          bool backwards) {
  const std::size_t last = backwards ? 14 : 12;  // the neighbour that has just changed
  for (std::size_t m = 0; m < nodes; ++m) {
    const std::size_t n = backwards ? nodes - 1 - m : m;
    const double* row = stencil + 27 * n;
    double* at = x + kWidth * n;
    Lanes sums[3] = {*reinterpret_cast<const Lanes*>(b + kWidth * n)};
    for (std::size_t s = 0; s < 27; ++s) {
      if (s == 13 || s == last) continue;
      sums[s % 3] -= row[s] * *reinterpret_cast<const Lanes*>(at + offsets.at[s]);
    }
    const Lanes before = sums[0] + sums[1] + sums[2];
    const Lanes rest = before - row[last] * *reinterpret_cast<const Lanes*>(at + offsets.at[last]);
    *reinterpret_cast<Lanes*>(at) = rest * (1.0 / row[13]);
  }
}

OPALINE_CLONES void dots(std::size_t nodes, const double* a, const double* b, double* out) {
  Lanes sum = {};
  for (std::size_t n = 0; n < nodes * kWidth; n += kWidth)
    sum += *reinterpret_cast<const Lanes*>(a + n) * *reinterpret_cast<const Lanes*>(b + n);
  *reinterpret_cast<Lanes*>(out) = sum;
}

// y = alpha x + beta y
OPALINE_CLONES void combine(
    std::size_t nodes, const double* alpha, const double* x, const double* beta, double* y) {
  const Lanes by = *reinterpret_cast<const Lanes*>(alpha);
  const Lanes keep = *reinterpret_cast<const Lanes*>(beta);
  for (std::size_t n = 0; n < nodes * kWidth; n += kWidth)
    *reinterpret_cast<Lanes*>(y + n) =
        by * *reinterpret_cast<const Lanes*>(x + n) + keep * *reinterpret_cast<const Lanes*>(y + n);
}

/// Values at the nodes, with room before and after them for what the stencil multiplies by zero.
class Field {
 public:
  explicit Field(const ElementMesh& mesh)
      : halo_((mesh.axes[0].nodes() * (mesh.axes[1].nodes() + 1) + 1) * kWidth),
        values_(2 * halo_ + mesh.nodes() * kWidth, 0.0) {}
  double* data() { return values_.data() + halo_; }
  const double* data() const { return values_.data() + halo_; }
  std::size_t size() const { return values_.size() - 2 * halo_; }
  void clear() { std::fill(values_.begin(), values_.end(), 0.0); }

 private:
  std::size_t halo_;
  std::vector<double> values_;
};

/// Calls visit(fine node, coarse node, weight) for all that interpolation joins.
template <class Visit>
void for_interpolation(const ElementMesh& fine, const ElementMesh& coarse, Visit visit) {
  const auto& [ax, ay, az] = fine.axes;
  for (std::size_t k = 0; k < az.nodes(); ++k)
    for (std::size_t j = 0; j < ay.nodes(); ++j)
      for (std::size_t i = 0; i < ax.nodes(); ++i)
        for (std::size_t c = 0; c < 8; ++c) {
          const bool x = (c & 1U) != 0;
          const bool y = (c >> 1U & 1U) != 0;
          const bool z = (c >> 2U) != 0;
          const double weight = (x ? ax.shares[i] : 1.0 - ax.shares[i]) *
                                (y ? ay.shares[j] : 1.0 - ay.shares[j]) *
                                (z ? az.shares[k] : 1.0 - az.shares[k]);
          if (weight == 0.0) continue;
          visit(fine.node(i, j, k),
                coarse.node(ax.parent_nodes[i] + (x ? 1 : 0),
                            ay.parent_nodes[j] + (y ? 1 : 0),
                            az.parent_nodes[k] + (z ? 1 : 0)),
                weight);
        }
}

void add(double weight, const double* from, double* to) {
  for (std::size_t w = 0; w < kWidth; ++w) to[w] += weight * from[w];
}

}  // namespace

class ElementSolver::Levels {
 public:
  explicit Levels(const std::vector<ElementMesh>& meshes)
      : phi(meshes.front()), direction(meshes.front()), product(meshes.front()) {
    for (const ElementMesh& mesh : meshes)
      levels_.push_back({&mesh, offsets_of(mesh), Field(mesh), Field(mesh), Field(mesh)});
  }

  Field& right() { return levels_.front().b; }      // of the V-cycle
  Field& corrected() { return levels_.front().x; }  // its answer
  const ElementMesh& mesh() const { return *levels_.front().mesh; }
  const Offsets& offsets() const { return levels_.front().offsets; }

  void v_cycle(std::size_t l = 0) {
    Level& at = levels_[l];
    const double* stencil = at.mesh->stencil.data();
    const std::size_t nodes = at.mesh->nodes();
    at.x.clear();
    const bool coarsest = l + 1 == levels_.size();
    for (int n = 0; n < (coarsest ? kCoarsestSweeps : 1); ++n) {
      sweep(stencil, at.offsets, nodes, at.b.data(), at.x.data(), false);
      if (coarsest) sweep(stencil, at.offsets, nodes, at.b.data(), at.x.data(), true);
    }
    if (coarsest) return;
    residual(stencil, at.offsets, nodes, at.b.data(), at.x.data(), at.r.data());
    Level& coarse = levels_[l + 1];
    coarse.b.clear();
    for_interpolation(
        *at.mesh, *coarse.mesh, [&](std::size_t fine, std::size_t node, double weight) {
          add(weight, at.r.data() + fine * kWidth, coarse.b.data() + node * kWidth);
        });
    v_cycle(l + 1);
    for_interpolation(
        *at.mesh, *coarse.mesh, [&](std::size_t fine, std::size_t node, double weight) {
          add(weight, coarse.x.data() + node * kWidth, at.x.data() + fine * kWidth);
        });
    sweep(stencil, at.offsets, nodes, at.b.data(), at.x.data(), true);
  }

  Field phi;
  Field direction;
  Field product;

 private:
  struct Level {
    const ElementMesh* mesh;
    Offsets offsets;
    Field b;
    Field x;
    Field r;
  };
  std::vector<Level> levels_;
};

ElementSolver::ElementSolver(const std::vector<ElementMesh>& levels)
    : levels_(std::make_unique<Levels>(levels)) {}
ElementSolver::~ElementSolver() = default;

int ElementSolver::solve(std::span<const double> b, std::span<double> phi, double tolerance) {
  Levels& l = *levels_;
  const std::size_t nodes = l.mesh().nodes();
  Field& r = l.right();
  std::copy(b.begin(), b.end(), r.data());
  l.phi.clear();
  l.direction.clear();
  Scalars norm{};
  dots(nodes, r.data(), r.data(), norm.data());
  Scalars ones{};
  ones.fill(1.0);
  Scalars energy{};
  int iteration = 0;
  for (; iteration < kMaxIterations; ++iteration) {
    Scalars left{};
    dots(nodes, r.data(), r.data(), left.data());
    bool done = true;
    for (std::size_t w = 0; w < kWidth; ++w)
      done = done && left[w] <= tolerance * tolerance * norm[w];
    if (done) break;
    l.v_cycle();
    Scalars next{};
    dots(nodes, r.data(), l.corrected().data(), next.data());
    Scalars beta{};
    for (std::size_t w = 0; w < kWidth; ++w) beta[w] = energy[w] > 0.0 ? next[w] / energy[w] : 0.0;
    energy = next;
    combine(nodes, ones.data(), l.corrected().data(), beta.data(), l.direction.data());
    residual(
        l.mesh().stencil.data(), l.offsets(), nodes, nullptr, l.direction.data(), l.product.data());
    Scalars curvature{};
    dots(nodes, l.direction.data(), l.product.data(), curvature.data());
    Scalars alpha{};
    Scalars minus{};
    for (std::size_t w = 0; w < kWidth; ++w) {
      alpha[w] = curvature[w] > 0.0 ? energy[w] / curvature[w] : 0.0;
      minus[w] = -alpha[w];
    }
    combine(nodes, alpha.data(), l.direction.data(), ones.data(), l.phi.data());
    combine(nodes, minus.data(), l.product.data(), ones.data(), r.data());
  }
  std::copy(l.phi.data(), l.phi.data() + nodes * kWidth, phi.begin());
  return iteration;
}

}  // namespace opaline::bench
