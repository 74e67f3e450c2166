#pragma once

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "base/block.h"
#include "reconstruct/diffusion/boundary.h"
#include "reconstruct/diffusion/fluence_solver.h"

namespace opaline::reconstruct::diffusion {

/// How light that was transmitted into a face enters the diffusion equation (docs/physics.md, "How
/// light enters").
enum class SourceModel : std::uint8_t {
  kCollimated,  ///< volume source of first scattering along the perpendicular ray: for projectors
  kSurface,     ///< q in the boundary condition: for diffuse light
};
std::string_view to_string(SourceModel model);  ///< "collimated" | "surface"

/// Where a cell's share of the collimated source is put.
enum class Deposit : std::uint8_t {
  kCentroid,  ///< at the centroid of the exponential within the cell: right also for optically
              ///< thick cells
  kCell,      ///< at the cell's centre
};
std::string_view to_string(Deposit deposit);  ///< "centroid" | "cell"

struct SourceOptions {
  SourceModel model = SourceModel::kCollimated;
  Deposit deposit = Deposit::kCentroid;
};

/// Derivatives of an objective by the medium, one value a cell, at fixed other coefficient.
struct MediumGradient {
  std::vector<double> diffusion;   ///< dJ/dkappa
  std::vector<double> absorption;  ///< dJ/dsigma_a at fixed kappa

  explicit MediumGradient(std::size_t cells) : diffusion(cells, 0.0), absorption(cells, 0.0) {}
};

/// A small change of a medium, one value a cell.
struct MediumChange {
  std::vector<double> diffusion;   ///< dkappa, mm
  std::vector<double> absorption;  ///< dsigma_a, 1/mm
};

/// What enters the surface equations of the lit face, one value a cell of that face:
///   J_n = g_b (phi - S) + X,    M = q + J_n with the surface source, M = J_n with the collimated
///   one.
struct SurfaceTerms {
  std::vector<double> source;  ///< S = 4 q / (1 - R_phi); 0 with the collimated source
  std::vector<double> escape;  ///< X: scattered light leaving at once (centroid deposit), W/mm^2
};

/// Where the power of one illumination goes that does not come out by diffusion, W.
struct SourcePower {
  double entered = 0.0;         ///< sum of a q
  double absorbed_first = 0.0;  ///< before the first scattering
  double ballistic = 0.0;       ///< out of the far side, never scattered
};

/// Light through one face of a medium: the right-hand side, the surface terms, and their
/// derivatives.
///
/// A perpendicular ray of power P = a q crosses cells n = 1..N with t_n = h / (3 kappa_n):
///   E_n = E_(n-1) e^(-t_n),  D_n = E_(n-1) - E_n,  alpha'_n = 1 - 3 kappa_n sigma_a,n,  Q_n = P
///   alpha'_n D_n cell:      b_n += Q_n centroid:  beta(t) = 1/2 - 1/t + 1/(e^t - 1);  n >= 2: b_n
///   += Q_n (1 - beta_n), b_(n-1) += Q_n beta_n;
///              n = 1: e = g_b beta_1 h / kappa_1, b_1 += Q_1 (1 - e), X = Q_1 e / a
/// and the surface source: b_i += a g_b S                              (docs/physics.md, "Gradient,
/// in full")
///
/// Shapes: q is the *transmitted* irradiance, (1 - R(0)) E, one value a cell of the face (row-major
/// raster), W/mm^2.
class FaceSource {
 public:
  FaceSource(const Medium& medium, const Boundary& boundary, Face face, SourceOptions options);

  /// Adds this light to a right-hand side of K phi = b, W a cell.
  void deposit(std::span<const double> q, std::span<double> b) const;
  SurfaceTerms surface_terms(std::span<const double> q) const;
  SourcePower power(std::span<const double> q) const;

  /// Adds the ray terms of the discrete adjoint gradient; nothing with the surface source, whose
  /// terms belong to the boundary. `psi` is the adjoint field; `flux_residual` is dJ/dJ_n on the
  /// lit face, or empty where nobody looks.
  void add_gradient(std::span<const double> q,
                    std::span<const double> psi,
                    std::span<const double> flux_residual,
                    MediumGradient& gradient) const;

  /// The same derivatives forwards: adds db/dmedium . change to `b`, dX/dmedium . change to `escape`
  /// (one value a cell of the face). The surface source's b changes with g_b.
  void add_tangent(std::span<const double> q,
                   const MediumChange& change,
                   std::span<double> b,
                   std::span<double> escape) const;

 private:
  struct RayCell {  // one cell of one column, for a ray of unit power
    std::size_t cell = 0;
    double kappa = 0.0;
    double absorption = 0.0;
    double albedo = 0.0;     // alpha'
    double deposited = 0.0;  // D
    double remaining = 0.0;  // E
    double beta = 0.0;
    double beta_slope = 0.0;
  };
  std::span<const RayCell> column(std::size_t face_cell) const {
    return std::span(rays_).subspan(face_cell * depth_, depth_);
  }
  RayCell ray_cell(const Medium& medium, std::size_t cell, double arriving) const;
  double first_escape(const RayCell& first) const;        // e
  double first_escape_slope(const RayCell& first) const;  // de/dkappa
  double adjoint_weight(std::span<const RayCell> ray,
                        std::size_t n,
                        std::span<const double> psi,
                        double rim) const;

  Boundary boundary_;
  SourceOptions options_;
  double area_ = 0.0;
  double h_ = 0.0;
  std::size_t depth_ = 0;
  std::vector<RayCell> rays_;  // columns one after another, from the lit face inwards
};

}  // namespace opaline::reconstruct::diffusion
