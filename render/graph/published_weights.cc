#include "render/graph/published_weights.h"

#include <fmt/format.h>

#include "base/ensure.h"

namespace opaline::render {
namespace {

double weight(double length) { return 1.0 / (length * length); }

}  // namespace

template <class T>
Result<void> PublishedWeights<T>::set_material(std::span<const Optics> optics) {
  if (optics.size() != graph_.inner.size()) {
    return invalid_argument(
        fmt::format("{} places of material for {} nodes", optics.size(), graph_.inner.size()));
  }
  if (auto valid = validate(optics); !valid) return valid.error();
  diffusion_.resize(graph_.surface.size());
  blends_.resize(graph_.surface.size());
  matrix_ = {};
  for (std::size_t i = 0; i < graph_.inner.size(); ++i) {
    const auto& kappa = optics[i].diffusion;
    Lanes<T> sink = Lanes<T>::zero();
    for (int c = 0; c < 3; ++c) sink.set(c, static_cast<T>(optics[i].absorption[c] / kappa[c]));
    for (const QuadGraph::Link& link : graph_.links[i]) {
      const double w = weight(link.length);
      if (link.inner >= 0) {
        Lanes<T> entry = Lanes<T>::zero();
        for (int c = 0; c < 3; ++c) entry.set(c, static_cast<T>(-w));
        matrix_.columns.push_back(link.inner);
        matrix_.entries.push_back(entry);
      } else if (link.surface >= 0) {
        for (int c = 0; c < 3; ++c) {
          const double flow = 2.0 * boundary_.a * kappa[c];
          const double blend = flow / (flow + link.length);
          diffusion_[link.surface][c] = kappa[c];
          blends_[link.surface][c] = blend;
          sink.set(c, sink[c] + static_cast<T>(w * (1.0 - blend)));
        }
      }
    }
    matrix_.sinks.push_back(sink);
    matrix_.starts.push_back(static_cast<int>(matrix_.columns.size()));
  }
  return ok();
}

template <class T>
void PublishedWeights<T>::load(std::span<const std::array<float, 3>> q,
                               std::vector<Lanes<T>>& b) const {
  ENSURE(q.size() == graph_.surface.size());
  b.assign(graph_.inner.size(), Lanes<T>::zero());
  for (std::size_t s = 0; s < q.size(); ++s) {
    const auto& node = graph_.surface[s];
    for (int c = 0; c < 3; ++c) {
      const double source = boundary_.source_scale * q[s][c];
      const double inflow = weight(node.length) * (1.0 - blends_[s][c]) * diffusion_[s][c] * source;
      b[node.inner].set(c, b[node.inner][c] + static_cast<T>(inflow));
    }
  }
}

template <class T>
SurfaceLight PublishedWeights<T>::surface_light(std::span<const std::array<float, 3>> q,
                                                const std::vector<Lanes<T>>& psi) const {
  ENSURE(q.size() == graph_.surface.size() && psi.size() == graph_.inner.size());
  SurfaceLight light{std::vector<std::array<float, 3>>(q.size()),
                     std::vector<std::array<float, 3>>(q.size())};
  for (std::size_t s = 0; s < q.size(); ++s) {
    for (int c = 0; c < 3; ++c) {
      const double source = boundary_.source_scale * q[s][c];
      const double inside = psi[graph_.surface[s].inner][c] / diffusion_[s][c];
      const double fluence = source + blends_[s][c] * (inside - source);
      light.fluence[s][c] = static_cast<float>(fluence);
      light.net_flux[s][c] = static_cast<float>((fluence - source) / (2.0 * boundary_.a));
    }
  }
  return light;
}

template class PublishedWeights<float>;
template class PublishedWeights<double>;

}  // namespace opaline::render
