#include "render/graph/two_point.h"

#include <fmt/format.h>

#include "base/ensure.h"
#include "render/solver/large_pages.h"

namespace opaline::render {
namespace {

template <class T>
Lanes<T> conductance(const Optics& optics, double reach, double two_a) {
  Lanes<T> g = Lanes<T>::zero();
  for (int c = 0; c < 3; ++c) g.set(c, static_cast<T>(1.0 / (two_a + reach / optics.diffusion[c])));
  return g;
}

/// a / (d_i / kappa_i + d_k / kappa_k)
template <class T>
Lanes<T> coupling(
    double area, double reach, const Optics& own, double other_reach, const Optics& other) {
  Lanes<T> sum = Lanes<T>::zero();
  for (int c = 0; c < 3; ++c) {
    sum.set(c,
            static_cast<T>(area / (reach / own.diffusion[c] + other_reach / other.diffusion[c])));
  }
  return sum;
}

template <class Graph>
double reach_back(const Graph& graph, int from, int to) {
  for (const auto& link : graph.links[from]) {
    if (link.inner == to) return link.reach;
  }
  return 0.0;
}

}  // namespace

template <class T, class Graph>
TwoPoint<T, Graph>::TwoPoint(const Graph& graph, const reconstruct::diffusion::Boundary& boundary)
    : graph_(graph), boundary_(boundary) {
  reserve_large(matrix_.columns, 4 * graph.inner.size());
  for (const auto& links : graph.links) {
    for (const auto& link : links) {
      if (link.inner >= 0) matrix_.columns.push_back(link.inner);
    }
    matrix_.starts.push_back(static_cast<int>(matrix_.columns.size()));
  }
  matrix_.entries = large_vector(matrix_.columns.size(), Lanes<T>::zero());
  matrix_.sinks = large_vector(graph.inner.size(), Lanes<T>::zero());
  conductances_.resize(graph.surface.size(), Lanes<T>::zero());
}

template <class T, class Graph>
Result<void> TwoPoint<T, Graph>::set_material(std::span<const Optics> optics) {
  if (optics.size() != graph_.inner.size()) {
    return invalid_argument(
        fmt::format("{} places of material for {} nodes", optics.size(), graph_.inner.size()));
  }
  if (auto valid = validate(optics); !valid) return valid.error();
  for (std::size_t i = 0; i < graph_.inner.size(); ++i) {
    Lanes<T> sink = Lanes<T>::zero();
    for (int c = 0; c < 3; ++c)
      sink.set(c, static_cast<T>(graph_.volumes[i] * optics[i].absorption[c]));
    int entry = matrix_.starts[i];
    for (const auto& link : graph_.links[i]) {
      if (link.inner >= 0) {
        const double back = reach_back(graph_, link.inner, static_cast<int>(i));
        matrix_.entries[entry++] =
            coupling<T>(link.area, link.reach, optics[i], back, optics[link.inner]) * T{-1};
      } else if (link.surface >= 0) {
        conductances_[link.surface] = conductance<T>(optics[i], link.reach, 2.0 * boundary_.a);
        sink += conductances_[link.surface] * static_cast<T>(link.area);
      }
    }
    matrix_.sinks[i] = sink;
  }
  return ok();
}

template <class T, class Graph>
void TwoPoint<T, Graph>::load(std::span<const std::array<float, 3>> q,
                              std::vector<Lanes<T>>& b) const {
  ENSURE(q.size() == graph_.surface.size());
  reserve_large(b, graph_.inner.size());
  b.assign(graph_.inner.size(), Lanes<T>::zero());
  for (std::size_t s = 0; s < q.size(); ++s) {
    Lanes<T> source = Lanes<T>::zero();
    for (int c = 0; c < 3; ++c)
      source.set(c, static_cast<T>(graph_.surface[s].area * boundary_.source_scale * q[s][c]));
    b[graph_.surface[s].inner] += conductances_[s] * source;
  }
}

template <class T, class Graph>
SurfaceLight TwoPoint<T, Graph>::surface_light(std::span<const std::array<float, 3>> q,
                                               const std::vector<Lanes<T>>& phi,
                                               std::span<const Lanes<T>> delta) const {
  ENSURE(q.size() == graph_.surface.size() && phi.size() == graph_.inner.size());
  SurfaceLight light{std::vector<std::array<float, 3>>(q.size()),
                     std::vector<std::array<float, 3>>(q.size())};
  for (std::size_t s = 0; s < q.size(); ++s) {
    for (int c = 0; c < 3; ++c) {
      const double source = boundary_.source_scale * q[s][c];
      const double off = delta.empty() ? 0.0 : delta[s][c];
      const double flux = conductances_[s][c] * (phi[graph_.surface[s].inner][c] + off - source);
      light.net_flux[s][c] = static_cast<float>(flux);
      light.fluence[s][c] = static_cast<float>(source + 2.0 * boundary_.a * flux);
    }
  }
  return light;
}

template class TwoPoint<float>;
template class TwoPoint<double>;
template class TwoPoint<float, Polygrid>;
template class TwoPoint<double, Polygrid>;

}  // namespace opaline::render
