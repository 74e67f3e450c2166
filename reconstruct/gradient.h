#pragma once

#include <array>
#include <span>
#include <vector>

#include "reconstruct/diffusion/boundary.h"
#include "reconstruct/diffusion/fluence_solver.h"
#include "reconstruct/diffusion/source.h"

namespace opaline::reconstruct {

/// The matrix's and the boundary's share of the discrete adjoint gradient (docs/physics.md,
/// "Gradient, in full"):
///
///   dJ/dsigma_a,i = - V psi_i phi_i
///   dJ/dkappa_i   = - sum_faces(ij) (a/h) kappa_f^2 / (2 kappa_i^2) (psi_i - psi_j)(phi_i - phi_j)
///                   + sum_boundary f of i  g_b^2 h / (2 kappa_i^2) (phi_i - S_f)(r_f - a psi_i)
///
/// with K psi = sum_f r_f g_b e_i(f) and r_f = dJ/dJ_n on face cell f. The products are summed over
/// the illuminations first, so the coefficients are touched once. The ray terms are
/// FaceSource::add_gradient's.
class MatrixGradient {
 public:
  explicit MatrixGradient(const Block& block);

  /// Sums the products of all illuminations inside the block.
  void gather(const diffusion::FieldBatch& phi, const diffusion::FieldBatch& psi);
  /// Sums its products on one face; `source` (S_f) and `flux_residual` (r_f) may be empty: zero.
  /// For all six faces.
  void gather_face(Face face,
                   std::span<const double> phi,
                   std::span<const double> psi,
                   std::span<const double> source,
                   std::span<const double> flux_residual);
  /// Adds the gathered share to the gradient.
  void add_to(const diffusion::Medium& medium,
              const diffusion::Boundary& boundary,
              diffusion::MediumGradient& gradient) const;

 private:
  void gather(const double* phi, const double* psi, std::size_t first, std::size_t end);
  void add_inner_faces(std::size_t axis,
                       const diffusion::Medium& medium,
                       diffusion::MediumGradient& gradient) const;
  Block block_;
  std::vector<double> mass_;  // sum psi phi
  std::array<std::vector<double>, 3>
      differences_;  // sum (psi_i - psi_j)(phi_i - phi_j), j the next along the axis
  std::array<std::vector<double>, 6> rims_;  // sum (phi - S)(r - a psi)
};

}  // namespace opaline::reconstruct
