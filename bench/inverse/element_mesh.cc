#include "bench/inverse/element_mesh.h"

#include <algorithm>
#include <functional>

namespace opaline::bench {
namespace {

using ElementFunction = std::function<ElementMatrix(std::size_t, std::size_t, std::size_t)>;

ElementAxis uniform_axis(int elements, double width) {
  return {std::vector<double>(static_cast<std::size_t>(elements), width), {}, {}, {}};
}

double widest(const ElementAxis& axis) {
  return *std::max_element(axis.widths.begin(), axis.widths.end());
}

/// Two elements become one; the last one of an odd number stays alone.
ElementAxis halved(ElementAxis& fine) {
  ElementAxis coarse;
  fine.parent_nodes.assign(fine.nodes(), 0);
  fine.shares.assign(fine.nodes(), 0.0);
  for (std::size_t f = 0; f < fine.elements(); ++f) {
    const auto parent = static_cast<std::uint32_t>(f / 2);
    fine.parents.push_back(parent);
    if (f % 2 == 0) coarse.widths.push_back(0.0);
    coarse.widths.back() += fine.widths[f];
  }
  for (std::size_t n = 0; n < fine.nodes(); ++n) {
    const std::size_t parent = std::min(n / 2, coarse.elements() - 1);
    fine.parent_nodes[n] = static_cast<std::uint32_t>(parent);
    const bool right_end = n == 2 * parent + 2 || n == fine.elements();
    fine.shares[n] = n == 2 * parent ? 0.0
                     : right_end     ? 1.0
                                     : fine.widths[n - 1] / coarse.widths[parent];
  }
  return coarse;
}

ElementAxis unchanged(ElementAxis& fine) {
  for (std::size_t f = 0; f < fine.elements(); ++f)
    fine.parents.push_back(static_cast<std::uint32_t>(f));
  for (std::size_t n = 0; n < fine.nodes(); ++n) {
    const bool last = n == fine.elements();
    fine.parent_nodes.push_back(static_cast<std::uint32_t>(last ? n - 1 : n));
    fine.shares.push_back(last ? 1.0 : 0.0);
  }
  return {fine.widths, {}, {}, {}};
}

std::array<ElementAxis, 3> coarsened(std::array<ElementAxis, 3>& fine) {
  double narrowest = 1e300;
  for (const ElementAxis& axis : fine)
    if (axis.elements() > 1) narrowest = std::min(narrowest, widest(axis));
  std::array<ElementAxis, 3> coarse;
  for (std::size_t a = 0; a < 3; ++a) {
    const bool halve = fine[a].elements() > 1 && widest(fine[a]) <= 1.5 * narrowest;
    coarse[a] = halve ? halved(fine[a]) : unchanged(fine[a]);
  }
  return coarse;
}

/// Products of the one-dimensional integrals of linear functions.
ElementMatrix element_integrals(const std::array<double, 3>& h, double kappa, double absorption) {
  ElementMatrix out{};
  for (std::size_t a = 0; a < 8; ++a)
    for (std::size_t b = 0; b < 8; ++b) {
      std::array<double, 3> m{};
      std::array<double, 3> s{};
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const bool same = (a >> axis & 1U) == (b >> axis & 1U);
        m[axis] = h[axis] * (same ? 2 : 1) / 6.0;
        s[axis] = (same ? 1.0 : -1.0) / h[axis];
      }
      out[8 * a + b] = kappa * (s[0] * m[1] * m[2] + m[0] * s[1] * m[2] + m[0] * m[1] * s[2]) +
                       absorption * m[0] * m[1] * m[2];
    }
  return out;
}

/// int phi v / (2 A) over one face of an element.
void add_face(
    const std::array<double, 3>& h, std::size_t axis, bool far, double a, ElementMatrix& out) {
  for (std::size_t m = 0; m < 8; ++m)
    for (std::size_t n = 0; n < 8; ++n) {
      if ((m >> axis & 1U) != (far ? 1U : 0U) || (n >> axis & 1U) != (far ? 1U : 0U)) continue;
      double product = 1.0 / (2.0 * a);
      for (std::size_t other = 0; other < 3; ++other)
        if (other != axis)
          product *= h[other] * ((m >> other & 1U) == (n >> other & 1U) ? 2 : 1) / 6.0;
      out[8 * m + n] += product;
    }
}

void assemble(ElementMesh& mesh, const ElementFunction& matrix_of) {
  mesh.stencil.assign(mesh.nodes() * 27, 0.0);
  for (std::size_t k = 0; k < mesh.axes[2].elements(); ++k)
    for (std::size_t j = 0; j < mesh.axes[1].elements(); ++j)
      for (std::size_t i = 0; i < mesh.axes[0].elements(); ++i) {
        const ElementMatrix e = matrix_of(i, j, k);
        for (std::size_t m = 0; m < 8; ++m) {
          const std::size_t at = mesh.node(i + (m & 1U), j + (m >> 1U & 1U), k + (m >> 2U)) * 27;
          for (std::size_t n = 0; n < 8; ++n) {
            const std::size_t dx = 1 + (n & 1U) - (m & 1U);
            const std::size_t dy = 1 + (n >> 1U & 1U) - (m >> 1U & 1U);
            const std::size_t dz = 1 + (n >> 2U) - (m >> 2U);
            mesh.stencil[at + (dz * 3 + dy) * 3 + dx] += e[8 * m + n];
          }
        }
      }
}

/// P_e^T K_e P_e: P_e gives the corners of an element from those of the coarse element around it.
void add_galerkin(const std::array<std::array<double, 4>, 3>& along,
                  const ElementMatrix& fine,
                  ElementMatrix& coarse) {
  ElementMatrix p{};
  for (std::size_t f = 0; f < 8; ++f)
    for (std::size_t c = 0; c < 8; ++c)
      p[8 * f + c] = along[0][2 * (f & 1U) + (c & 1U)] *
                     along[1][2 * (f >> 1U & 1U) + (c >> 1U & 1U)] *
                     along[2][2 * (f >> 2U) + (c >> 2U)];
  ElementMatrix kp{};
  for (std::size_t f = 0; f < 8; ++f)
    for (std::size_t g = 0; g < 8; ++g)
      for (std::size_t c = 0; c < 8; ++c) kp[8 * f + c] += fine[8 * f + g] * p[8 * g + c];
  for (std::size_t f = 0; f < 8; ++f)
    for (std::size_t c = 0; c < 8; ++c)
      for (std::size_t d = 0; d < 8; ++d) coarse[8 * c + d] += p[8 * f + c] * kp[8 * f + d];
}

/// Values at the two ends of element `e` from those at the ends of its parent.
std::array<double, 4> ends_of(const ElementAxis& axis, std::size_t e) {
  const double left = axis.parent_nodes[e] == axis.parents[e] ? axis.shares[e] : 0.0;
  const double right = axis.parent_nodes[e + 1] == axis.parents[e] ? axis.shares[e + 1] : 1.0;
  return {1.0 - left, left, 1.0 - right, right};
}

std::vector<ElementMatrix> galerkin(const ElementMesh& fine,
                                    const ElementMesh& coarse,
                                    const ElementFunction& matrix_of) {
  std::vector<ElementMatrix> out(coarse.elements(), ElementMatrix{});
  for (std::size_t k = 0; k < fine.axes[2].elements(); ++k)
    for (std::size_t j = 0; j < fine.axes[1].elements(); ++j)
      for (std::size_t i = 0; i < fine.axes[0].elements(); ++i) {
        const std::size_t parent = coarse.element(
            fine.axes[0].parents[i], fine.axes[1].parents[j], fine.axes[2].parents[k]);
        add_galerkin({ends_of(fine.axes[0], i), ends_of(fine.axes[1], j), ends_of(fine.axes[2], k)},
                     matrix_of(i, j, k),
                     out[parent]);
      }
  return out;
}

ElementFunction finest_elements(const Block& block,
                                const ChannelCoefficients& c,
                                double a,
                                const Refinement& r) {
  const std::array<double, 3> h{block.hx / r[0], block.hy / r[1], block.hz / r[2]};
  return [&block, &c, a, r, h](std::size_t i, std::size_t j, std::size_t k) {
    const std::array<std::size_t, 3> at{i, j, k};
    const std::size_t cell = block.index(
        static_cast<int>(i) / r[0], static_cast<int>(j) / r[1], static_cast<int>(k) / r[2]);
    const double kappa = 1.0 / (3.0 * (c.absorption[cell] + c.reduced_scattering[cell]));
    ElementMatrix e = element_integrals(h, kappa, c.absorption[cell]);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto last = static_cast<std::size_t>(block.cells()[axis] * r[axis] - 1);
      if (at[axis] == 0) add_face(h, axis, false, a, e);
      if (at[axis] == last) add_face(h, axis, true, a, e);
    }
    return e;
  };
}

}  // namespace

std::vector<ElementMesh> element_hierarchy(const Block& block,
                                           const ChannelCoefficients& coefficients,
                                           double boundary_a,
                                           const Refinement& r) {
  constexpr std::size_t kFew = 64;
  std::vector<ElementMesh> levels(1);
  levels[0].axes = {uniform_axis(block.nx * r[0], block.hx / r[0]),
                    uniform_axis(block.ny * r[1], block.hy / r[1]),
                    uniform_axis(block.nz * r[2], block.hz / r[2])};
  ElementFunction matrix_of = finest_elements(block, coefficients, boundary_a, r);
  std::vector<ElementMatrix> stored;
  for (;;) {
    ElementMesh& fine = levels.back();
    assemble(fine, matrix_of);
    if (fine.nodes() <= kFew || fine.elements() == 1) return levels;
    ElementMesh coarse;
    coarse.axes = coarsened(fine.axes);
    std::vector<ElementMatrix> next = galerkin(fine, coarse, matrix_of);
    stored = std::move(next);
    matrix_of = [&stored, nx = coarse.axes[0].elements(), ny = coarse.axes[1].elements()](
                    std::size_t i, std::size_t j, std::size_t k) {
      return stored[(k * ny + j) * nx + i];
    };
    levels.push_back(std::move(coarse));
  }
}

}  // namespace opaline::bench
