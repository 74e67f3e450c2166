#include "render/graph/relaxation.h"

#include <utility>

#include "base/flush_denormals.h"
#include "render/graph/nearest.h"
#include "render/solver/lane_matrix.h"

namespace opaline::render {
namespace {

constexpr int kInnerNeighbours = 8;
constexpr int kSurfaceNeighbours = 4;

template <class Work>
void over_rows(std::size_t rows, ThreadTeam& team, const Work& work) {
  team.run([&](int thread) {
    const FlushDenormals flush;
    const RowRange range = share_of(static_cast<int>(rows), thread, team.size());
    for (int i = range.first; i < range.last; ++i) work(i);
  });
}

void interpolate(const Interpolation<float>& p,
                 const std::vector<Lanes<float>>& coarse,
                 std::vector<Lanes<float>>& fine,
                 ThreadTeam& team) {
  over_rows(fine.size(), team, [&](int i) {
    Lanes<float> sum = Lanes<float>::zero();
    for (int e = p.starts[i]; e < p.starts[i + 1]; ++e) sum += coarse[p.columns[e]] * p.weights[e];
    fine[i] = sum;
  });
}

std::vector<Vec3> places_of(const std::vector<QuadGraph::SurfaceNode>& surface) {
  std::vector<Vec3> places;
  places.reserve(surface.size());
  for (const auto& node : surface) places.push_back(node.place);
  return places;
}

/// What one link puts above and below the line of Eq. 8.
struct LinkWeight {
  double above = 0.0;
  double below = 0.0;
};

LinkWeight published_weight(const QuadGraph::Link& link, double own, double other) {
  const double w = 1.0 / (link.length * link.length);
  return {w * other, w * own};
}

LinkWeight two_point_weight(const QuadGraph::Link& link,
                            double own,
                            double other,
                            double other_reach) {
  const double w = link.area / (link.reach / own + other_reach / other);
  return {w, w};
}

double reach_back(const QuadGraph& graph, int from, int to) {
  for (const QuadGraph::Link& link : graph.links[from]) {
    if (link.inner == to) return link.reach;
  }
  return 0.0;
}

}  // namespace

Relaxation::Relaxation(std::span<const QuadGraph* const> graphs,
                       const std::function<Optics(Vec3)>& material,
                       const reconstruct::diffusion::Boundary& boundary,
                       GraphWeights weights)
    : source_scale_(boundary.source_scale) {
  levels_.reserve(graphs.size());
  for (const QuadGraph* graph : graphs) {
    levels_.push_back(make_level(*graph, material, boundary, weights));
    if (levels_.size() == 1) continue;
    const QuadGraph& coarse = *levels_[levels_.size() - 2].graph;
    levels_.back().inner_from = nearest_interpolation(coarse.inner, graph->inner, kInnerNeighbours);
    levels_.back().surface_from = nearest_interpolation(
        places_of(coarse.surface), places_of(graph->surface), kSurfaceNeighbours);
  }
}

Relaxation::Level Relaxation::make_level(const QuadGraph& graph,
                                         const std::function<Optics(Vec3)>& material,
                                         const reconstruct::diffusion::Boundary& boundary,
                                         GraphWeights weights) {
  const bool published = weights == GraphWeights::kAsPublished;
  Level level;
  level.graph = &graph;
  const std::size_t count = graph.inner.size();
  level.neighbours.resize(count);
  level.weights.resize(count);
  level.phi.assign(count, Lanes<float>::zero());
  level.next = level.phi;
  level.blends.assign(graph.surface.size(), Lanes<float>::zero());
  level.sources = level.phi_surface = level.blends;
  std::vector<Optics> optics;
  optics.reserve(count);
  for (const Vec3& place : graph.inner) optics.push_back(material(place));
  for (std::size_t i = 0; i < count; ++i) {
    for (int c = 0; c < 3; ++c) {
      const double own = optics[i].diffusion[c];
      double below = optics[i].absorption[c] * (published ? 1.0 : graph.volumes[i]);
      std::array<double, 4> above{};
      for (int k = 0; k < 4; ++k) {
        const QuadGraph::Link& link = graph.links[i][k];
        const bool inner = link.inner >= 0;
        const double other = inner ? optics[link.inner].diffusion[c] : own;
        const double back =
            inner && !published ? reach_back(graph, link.inner, static_cast<int>(i)) : 0.0;
        const LinkWeight weight = published ? published_weight(link, own, other)
                                            : two_point_weight(link, own, other, back);
        above[k] = weight.above;
        below += weight.below;
        level.neighbours[i][k] = inner ? link.inner : ~link.surface;
        if (inner) continue;
        const double d = published ? link.length : link.reach;
        const double flow = 2.0 * boundary.a * own;
        level.blends[link.surface].set(c, static_cast<float>(flow / (flow + d)));
      }
      for (int k = 0; k < 4; ++k) level.weights[i][k].set(c, static_cast<float>(above[k] / below));
    }
    for (int k = 0; k < 4; ++k) level.weights[i][k].set(3, 0.0f);
  }
  return level;
}

void Relaxation::sweep(Level& level, ThreadTeam& team) {
  const auto& surface = level.graph->surface;
  over_rows(surface.size(), team, [&](int s) {
    const Lanes<float>& source = level.sources[s];
    level.phi_surface[s] = source + level.blends[s] * (level.phi[surface[s].inner] - source);
  });
  over_rows(level.phi.size(), team, [&](int i) {
    Lanes<float> sum = Lanes<float>::zero();
    for (int k = 0; k < 4; ++k) {
      const int n = level.neighbours[i][k];
      sum += level.weights[i][k] * (n >= 0 ? level.phi[n] : level.phi_surface[~n]);
    }
    level.next[i] = sum;
  });
  std::swap(level.phi, level.next);
}

void Relaxation::solve(const std::function<double(const QuadGraph::SurfaceNode&)>& q,
                       int sweeps,
                       ThreadTeam& team) {
  for (std::size_t l = 0; l < levels_.size(); ++l) {
    Level& level = levels_[l];
    for (std::size_t s = 0; s < level.sources.size(); ++s) {
      level.sources[s] =
          Lanes<float>::all(static_cast<float>(source_scale_ * q(level.graph->surface[s])));
    }
    if (l == 0) {
      level.phi.assign(level.phi.size(), Lanes<float>::zero());
    } else {
      interpolate(level.inner_from, levels_[l - 1].phi, level.phi, team);
      interpolate(level.surface_from, levels_[l - 1].phi_surface, level.phi_surface, team);
    }
    for (int i = 0; i < sweeps; ++i) sweep(level, team);
  }
}

}  // namespace opaline::render
