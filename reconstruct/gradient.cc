#include "reconstruct/gradient.h"

#include <algorithm>

namespace opaline::reconstruct {
namespace {

// Cells whose sums stay in the first-level cache while all illuminations pass: fluence and adjoint are then read once,
// 16 bytes a cell and illumination, and not the sums with them each time, 128.
constexpr std::size_t kChunk = 512;

std::array<std::size_t, 3> offsets(const Block& block) {
  return {1, static_cast<std::size_t>(block.nx), static_cast<std::size_t>(block.nx) * block.ny};
}

}  // namespace

MatrixGradient::MatrixGradient(const Block& block) : block_(block), mass_(block.cell_count(), 0.0) {
  for (auto& d : differences_) d.assign(block.cell_count(), 0.0);
  for (const Face face : kFaces) {
    rims_[static_cast<std::size_t>(face)].assign(block.face_cell_count(face), 0.0);
  }
}

void MatrixGradient::gather(const diffusion::FieldBatch& phi, const diffusion::FieldBatch& psi) {
  for (std::size_t first = 0; first < mass_.size(); first += kChunk) {
    const std::size_t end = std::min(first + kChunk, mass_.size());
    for (int m = 0; m < phi.count; ++m) gather(phi.field(m), psi.field(m), first, end);
  }
}

void MatrixGradient::gather(const double* phi,
                            const double* psi,
                            std::size_t first,
                            std::size_t end) {
  for (std::size_t i = first; i < end; ++i) mass_[i] += psi[i] * phi[i];
  for (std::size_t axis = 0; axis < 3; ++axis) {
    // Pairs that reach over the edge of the block are summed too and never read.
    const std::size_t offset = offsets(block_)[axis];
    const std::size_t last = mass_.size() > offset ? std::min(end, mass_.size() - offset) : 0;
    double* sums = differences_[axis].data();
    for (std::size_t i = first; i < last; ++i) {
      sums[i] += (psi[i] - psi[i + offset]) * (phi[i] - phi[i + offset]);
    }
  }
}

void MatrixGradient::gather_face(Face face,
                                 std::span<const double> phi,
                                 std::span<const double> psi,
                                 std::span<const double> source,
                                 std::span<const double> flux_residual) {
  const double area = block_.face_cell_area(face);
  auto& sums = rims_[static_cast<std::size_t>(face)];
  std::size_t f = 0;
  for (int row = 0; row < block_.face_height(face); ++row) {
    for (int column = 0; column < block_.face_width(face); ++column, ++f) {
      const std::size_t cell = block_.cell_behind(face, column, row);
      const double s = source.empty() ? 0.0 : source[f];
      const double r = flux_residual.empty() ? 0.0 : flux_residual[f];
      sums[f] += (phi[cell] - s) * (r - area * psi[cell]);
    }
  }
}

void MatrixGradient::add_to(const diffusion::Medium& medium,
                            const diffusion::Boundary& boundary,
                            diffusion::MediumGradient& gradient) const {
  const double volume = block_.cell_volume();
  for (std::size_t i = 0; i < mass_.size(); ++i) gradient.absorption[i] -= volume * mass_[i];
  for (std::size_t axis = 0; axis < 3; ++axis) add_inner_faces(axis, medium, gradient);
  for (const Face face : kFaces) {
    const double h = block_.spacing()[axis_of(face)];
    std::size_t f = 0;
    for (int row = 0; row < block_.face_height(face); ++row) {
      for (int column = 0; column < block_.face_width(face); ++column, ++f) {
        const std::size_t cell = block_.cell_behind(face, column, row);
        const double kappa = medium.diffusion[cell];
        const double g = boundary.conductance(h, kappa);
        gradient.diffusion[cell] +=
            g * g * h / (2.0 * kappa * kappa) * rims_[static_cast<std::size_t>(face)][f];
      }
    }
  }
}

void MatrixGradient::add_inner_faces(std::size_t axis,
                                     const diffusion::Medium& medium,
                                     diffusion::MediumGradient& gradient) const {
  const double h = block_.spacing()[axis];
  const double scale =
      2.0 * block_.cell_volume() / (h * h);  // (a / h) / 2, kappa_f = 2 ki kj / (ki + kj)
  const std::size_t offset = offsets(block_)[axis];
  const int ni = block_.nx - (axis == 0 ? 1 : 0);
  const int nj = block_.ny - (axis == 1 ? 1 : 0);
  const int nk = block_.nz - (axis == 2 ? 1 : 0);
  const auto& kappa = medium.diffusion;
  for (int k = 0; k < nk; ++k) {
    for (int j = 0; j < nj; ++j) {
      const std::size_t row = block_.index(0, j, k);
      for (std::size_t i = row; i < row + ni; ++i) {
        const double inverse_sum = 1.0 / (kappa[i] + kappa[i + offset]);
        const double product = scale * differences_[axis][i] * inverse_sum * inverse_sum;
        gradient.diffusion[i] -= product * kappa[i + offset] * kappa[i + offset];
        gradient.diffusion[i + offset] -= product * kappa[i] * kappa[i];
      }
    }
  }
}

}  // namespace opaline::reconstruct
