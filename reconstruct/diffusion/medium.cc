#include "reconstruct/diffusion/medium.h"

#include "base/ensure.h"

namespace opaline::reconstruct::diffusion {

Medium make_medium(const Block& block,
                   const ChannelCoefficients& channel,
                   const Boundary& boundary) {
  const std::size_t cells = block.cell_count();
  ENSURE(channel.absorption.size() == cells && channel.reduced_scattering.size() == cells);
  Medium medium{block, std::vector<double>(cells), channel.absorption, boundary.a};
  for (std::size_t i = 0; i < cells; ++i) {
    medium.diffusion[i] = 1.0 / (3.0 * (channel.absorption[i] + channel.reduced_scattering[i]));
  }
  return medium;
}

void net_flux(const Medium& medium,
              const Boundary& boundary,
              Face face,
              std::span<const double> phi,
              std::span<const double> source,
              std::span<const double> escape,
              std::span<double> flux) {
  const Block& block = medium.block;
  const double h = block.spacing()[axis_of(face)];
  ENSURE(phi.size() == block.cell_count() && flux.size() == block.face_cell_count(face));
  std::size_t f = 0;
  for (int row = 0; row < block.face_height(face); ++row) {
    for (int column = 0; column < block.face_width(face); ++column, ++f) {
      const std::size_t cell = block.cell_behind(face, column, row);
      const double s = source.empty() ? 0.0 : source[f];
      flux[f] = boundary.conductance(h, medium.diffusion[cell]) * (phi[cell] - s);
      if (!escape.empty()) flux[f] += escape[f];
    }
  }
}

std::vector<double> conductance_change(const Medium& medium,
                                       const Boundary& boundary,
                                       Face face,
                                       const MediumChange& change) {
  const Block& block = medium.block;
  const double h = block.spacing()[axis_of(face)];
  std::vector<double> moved;
  moved.reserve(block.face_cell_count(face));
  for (int row = 0; row < block.face_height(face); ++row) {
    for (int column = 0; column < block.face_width(face); ++column) {
      const std::size_t cell = block.cell_behind(face, column, row);
      const double kappa = medium.diffusion[cell];
      const double gb = boundary.conductance(h, kappa);
      moved.push_back(gb * gb * h / (2.0 * kappa * kappa) * change.diffusion[cell]);
    }
  }
  return moved;
}

}  // namespace opaline::reconstruct::diffusion
