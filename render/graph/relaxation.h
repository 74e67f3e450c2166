#pragma once

#include <functional>
#include <span>
#include <vector>

#include "base/thread_team.h"
#include "reconstruct/diffusion/boundary.h"
#include "render/graph/graph_weights.h"
#include "render/graph/optics.h"
#include "render/graph/quad_graph.h"
#include "render/solver/aggregation.h"
#include "render/solver/lanes.h"

namespace opaline::render {

/// The solution scheme of Wang 2010, to compare with: plain relaxation on independent graphs, coarsest first, each started
/// from the one before,
///
///   phi_i = sum_k w_ik phi_k / (sum_k w_ik (or w kappa_i, as published) + sigma_a,i (V)),
///   phi_s = (2 A kappa phi_i + d S) / (2 A kappa + d),   S = 4 q / (1 - R_phi)                             (Eqs. 8, 9)
///
/// interpolated from the 8 nearest inner nodes (4 for surface nodes), weighted by the inverse square of their distance
/// (Eq. 10). Eq. 9 prints 4 q / (1 + F_dr), which is 61.5 % of what Eq. 6 says at ior 1.3; here it is Eq. 6.
class Relaxation {
 public:
  /// Graphs from coarse to fine; they must outlive this.
  Relaxation(std::span<const QuadGraph* const> graphs,
             const std::function<Optics(Vec3)>& material,
             const reconstruct::diffusion::Boundary& boundary,
             GraphWeights weights);

  /// Takes the light at each level's surface nodes, and sweeps each level so many times, from darkness at the coarsest.
  void solve(const std::function<double(const QuadGraph::SurfaceNode&)>& q,
             int sweeps,
             ThreadTeam& team);

  /// The fluence of the finest level.
  const std::vector<Lanes<float>>& inner() const { return levels_.back().phi; }
  const std::vector<Lanes<float>>& surface() const { return levels_.back().phi_surface; }

 private:
  struct Level {
    const QuadGraph* graph = nullptr;
    std::vector<std::array<int, 4>> neighbours;        // a surface node s is ~s
    std::vector<std::array<Lanes<float>, 4>> weights;  // already over the denominator
    std::vector<Lanes<float>> blends;                  // phi_s = blend phi_i + (1 - blend) S
    std::vector<Lanes<float>> sources;                 // S
    std::vector<Lanes<float>> phi;
    std::vector<Lanes<float>> next;
    std::vector<Lanes<float>> phi_surface;
    Interpolation<float> inner_from;  // from the coarser level
    Interpolation<float> surface_from;
  };
  static Level make_level(const QuadGraph& graph,
                          const std::function<Optics(Vec3)>& material,
                          const reconstruct::diffusion::Boundary& boundary,
                          GraphWeights weights);
  static void sweep(Level& level, ThreadTeam& team);

  double source_scale_;
  std::vector<Level> levels_;
};

}  // namespace opaline::render
