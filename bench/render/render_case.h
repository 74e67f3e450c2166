#pragma once

#include <array>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "base/thread_team.h"
#include "reconstruct/diffusion/boundary.h"
#include "render/graph/quad_graph.h"
#include "render/graph/two_point.h"
#include "render/mesh/signed_distance.h"
#include "render/solver/lane_solver.h"
#include "render/tetrahedra/tet_mesh.h"

namespace opaline::bench {

/// eta = 1.3, both moments.
reconstruct::diffusion::Boundary render_boundary();

/// sigma_s' = 1, sigma_a = 0.01 per mm everywhere and in every channel.
render::Optics plain_optics();

/// A marbled solid: sigma_s' from 0.5 to 2, sigma_a from 0.003 to 0.13 per mm over channels and places.
render::Optics marbled_optics(Vec3 place);

/// A solid of about so many tetrahedra, packed; K = 0 unless given. Ends the program where that fails.
render::TetMesh cut(const render::SignedDistance& solid, double tets, double interior_growth = 0.0);
std::unique_ptr<render::SignedDistance> shape(std::string_view name);  ///< 20 mm across

/// q of a directional light that has gone `degrees` around, W/mm^2.
std::array<float, 3> light_around(const render::QuadGraph::SurfaceNode& node, double degrees);

/// A marbled object under that light, ready to be solved frame after frame in single precision.
class LitObject {
 public:
  LitObject(const render::TetMesh& mesh, ThreadTeam& team, int remembered);

  /// One frame's diffusion pass: light in, fluence, light out. `cold` forgets the last frame.
  reconstruct::diffusion::SolveSummary frame(double degrees, double tolerance, bool cold);
  /// Paints a ball of 4 mm around a place: sigma_a times `factor`.
  void paint(Vec3 place, double factor);

  const render::QuadGraph& graph() const { return graph_; }
  const std::vector<render::Lanes<float>>& fluence() const { return phi_; }

 private:
  render::QuadGraph graph_;
  std::vector<render::Optics> optics_;
  render::TwoPoint<float> diffusion_;
  std::unique_ptr<render::LaneSolver<float>> solver_;
  std::vector<std::array<float, 3>> q_;
  std::vector<render::Lanes<float>> b_;
  std::vector<render::Lanes<float>> phi_;
};

}  // namespace opaline::bench
