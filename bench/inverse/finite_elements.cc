#include "bench/inverse/finite_elements.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <vector>

#include "bench/inverse/element_mesh.h"
#include "bench/inverse/element_solver.h"
#include "reconstruct/diffusion/boundary.h"
#include "reconstruct/diffusion/camera_equation.h"

namespace opaline::bench {
namespace {

namespace diffusion = reconstruct::diffusion;

constexpr double kTolerance = 1e-9;
constexpr std::size_t kWidth = kElementFields;

/// int Q v of the perpendicular ray bundle of irradiance q, transmitted, through the elements above cell (x, y), into
/// right-hand side `lane`.
class Rays {
 public:
  Rays(const Block& block, const Refinement& refinement, const ChannelCoefficients& coefficients)
      : block_(block), r_(refinement), c_(coefficients) {}

  void add(int x, int y, double q, std::size_t lane, std::vector<double>& load) const {
    const double hz = block_.hz / r_[2];
    double arriving = q * (block_.hx / r_[0]) * (block_.hy / r_[1]);  // W a column of elements
    for (int k = 0; k < block_.nz * r_[2]; ++k) {
      const std::size_t cell = block_.index(x, y, k / r_[2]);
      const double extinction = c_.absorption[cell] + c_.reduced_scattering[cell];
      const double t = extinction * hz;
      const double scattered =
          arriving * -std::expm1(-t) * c_.reduced_scattering[cell] / extinction;
      const double far =
          t < 1e-4 ? 0.5 - t / 12.0 : 1.0 / t - 1.0 / std::expm1(t);  // centroid / hz
      spread(x, y, k, scattered / 4.0 * (1.0 - far), lane, load);
      spread(x, y, k + 1, scattered / 4.0 * far, lane, load);
      arriving *= std::exp(-t);
    }
  }

 private:
  // A quarter of a column's share to each of its four nodes of layer k, for all columns of the cell.
  void spread(
      int x, int y, int k, double power, std::size_t lane, std::vector<double>& load) const {
    const auto row = static_cast<std::size_t>(block_.nx) * r_[0] + 1;
    const auto plane = row * (static_cast<std::size_t>(block_.ny) * r_[1] + 1);
    for (int j = 0; j < r_[1]; ++j)
      for (int i = 0; i < r_[0]; ++i)
        for (const int corner : {0, 1, 2, 3}) {
          const std::size_t node = static_cast<std::size_t>(k) * plane +
                                   static_cast<std::size_t>(y * r_[1] + j + corner / 2) * row +
                                   static_cast<std::size_t>(x * r_[0] + i + corner % 2);
          load[node * kWidth + lane] += power;
        }
  }

  const Block& block_;
  const Refinement& r_;
  const ChannelCoefficients& c_;
};

double normal_transmittance(double ior) { return 1.0 - std::pow((ior - 1.0) / (ior + 1.0), 2); }

/// Of the piecewise linear function over one cell: its mean is the weighted sum of the nodes' values.
std::vector<double> mean_weights(int elements) {
  std::vector<double> weights(static_cast<std::size_t>(elements) + 1, 1.0 / elements);
  weights.front() = weights.back() = 0.5 / elements;
  return weights;
}

/// The flux through each cell of z_max, then the radiance to the camera.
void observe(const Block& block,
             const Refinement& r,
             const std::vector<double>& phi,
             std::size_t lane,
             const diffusion::Boundary& boundary,
             const TransportResponses& t,
             int channel,
             Image<float>& radiance) {
  const std::vector<double> wx = mean_weights(r[0]);
  const std::vector<double> wy = mean_weights(r[1]);
  const auto row = static_cast<std::size_t>(block.nx) * r[0] + 1;
  const auto plane = row * (static_cast<std::size_t>(block.ny) * r[1] + 1);
  const std::size_t top = static_cast<std::size_t>(block.nz) * r[2] * plane;
  for (int y = 0; y < block.ny; ++y)
    for (int x = 0; x < block.nx; ++x) {
      double mean = 0.0;
      for (std::size_t j = 0; j < wy.size(); ++j)
        for (std::size_t i = 0; i < wx.size(); ++i) {
          const std::size_t node = top + (static_cast<std::size_t>(y * r[1]) + j) * row +
                                   static_cast<std::size_t>(x * r[0]) + i;
          mean += wx[i] * wy[j] * phi[node * kWidth + lane];
        }
      const Vec3 to = normalized(t.camera_centre - block.face_cell_centre(Face::kZMax, x, y));
      const double gain = diffusion::camera_equation(t.ior, boundary, to.z).flux_gain;
      radiance.at(x, y, channel) = static_cast<float>(gain * mean / (2.0 * boundary.a));
    }
}

TransportResponses empty_responses(const Material& material, int patches) {
  TransportResponses t;
  t.block = material.block;
  t.ior = material.ior;
  t.lit_face = Face::kZMin;
  t.seen_face = Face::kZMax;
  t.patches_x = t.patches_y = patches;
  const Vec3 size = material.block.size();
  t.camera_centre = {size.x / 2.0, size.y / 2.0, size.z + 300.0};
  t.generator = "trilinear finite elements";
  const PatchResponse dark{Image<float>(t.block.nx, t.block.ny, kColorChannels),
                           Image<float>(t.block.nx, t.block.ny, kColorChannels)};
  t.patches.assign(static_cast<std::size_t>(patches) * patches, dark);
  return t;
}

/// Eight patches from `first` on, in one channel.
void add_patches(const std::vector<ElementMesh>& levels,
                 const ChannelCoefficients& c,
                 const Refinement& refinement,
                 const diffusion::Boundary& boundary,
                 std::size_t first,
                 int channel,
                 ElementSolver& solver,
                 TransportResponses& t) {
  std::vector<double> load(levels.front().nodes() * kWidth, 0.0);
  const Rays rays(t.block, refinement, c);
  for (int y = 0; y < t.block.ny; ++y)
    for (int x = 0; x < t.block.nx; ++x) {
      const int patch = (y * t.patches_y / t.block.ny) * t.patches_x + x * t.patches_x / t.block.nx;
      const auto lane = static_cast<std::size_t>(patch) - first;
      if (lane < kWidth) rays.add(x, y, normal_transmittance(t.ior), lane, load);
    }
  std::vector<double> phi(load.size());
  solver.solve(load, phi, kTolerance);
  for (std::size_t lane = 0; lane < kWidth && first + lane < t.patches.size(); ++lane)
    observe(t.block, refinement, phi, lane, boundary, t, channel, t.patches[first + lane].radiance);
}

}  // namespace

TransportResponses finite_element_responses(const Material& material,
                                            int patches,
                                            const Refinement& refinement) {
  const auto boundary =
      *diffusion::make_boundary(diffusion::BoundaryModel::kTwoMoment, material.ior);
  TransportResponses t = empty_responses(material, patches);
  for (std::size_t channel = 0; channel < kColorChannels; ++channel) {
    const ChannelCoefficients& c = material.channels[channel];
    const auto levels = element_hierarchy(t.block, c, boundary.a, refinement);
    fmt::print(stderr, "finite elements: channel {} of {}\n", channel + 1, kColorChannels);
#pragma omp parallel
    {
      ElementSolver solver(levels);
#pragma omp for schedule(dynamic)
      for (std::size_t first = 0; first < t.patches.size(); first += kWidth)
        add_patches(levels, c, refinement, boundary, first, static_cast<int>(channel), solver, t);
    }
  }
  return t;
}

}  // namespace opaline::bench
