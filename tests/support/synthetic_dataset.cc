#include "tests/support/synthetic_dataset.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <string>

#include "reconstruct/diffusion/camera_equation.h"
#include "reconstruct/diffusion/medium.h"
#include "reconstruct/diffusion/source.h"
#include "tests/support/direct_solver.h"

namespace opaline::testing_support {
namespace {

namespace diffusion = reconstruct::diffusion;

Block finer(const Block& b) { return {2 * b.nx, 2 * b.ny, 2 * b.nz, b.hx / 2, b.hy / 2, b.hz / 2}; }

// Share of [a, b] that lies within [lower, upper].
double overlap(double a, double b, double lower, double upper) {
  return std::clamp((std::min(b, upper) - std::max(a, lower)) / (b - a), 0.0, 1.0);
}

// Unit irradiance on a square region, fractional at its edges.
Image<float> region(const Block& block, double x, double y, double size_x, double size_y) {
  Image<float> light(block.nx, block.ny, kColorChannels);
  for (int j = 0; j < block.ny; ++j) {
    for (int i = 0; i < block.nx; ++i) {
      const double share = overlap(i * block.hx, (i + 1) * block.hx, x, x + size_x) *
                           overlap(j * block.hy, (j + 1) * block.hy, y, y + size_y);
      for (int c = 0; c < kColorChannels; ++c) light.at(i, j, c) = static_cast<float>(share);
    }
  }
  return light;
}

diffusion::Medium fine_medium(const SyntheticOptions& options,
                              int channel,
                              const diffusion::Boundary& boundary) {
  const Block block = finer(options.block);
  ChannelCoefficients c;
  for (int k = 0; k < block.nz; ++k) {
    for (int j = 0; j < block.ny; ++j) {
      for (int i = 0; i < block.nx; ++i) {
        const Vec3 centre{(i + 0.5) * block.hx, (j + 0.5) * block.hy, (k + 0.5) * block.hz};
        const Coefficients here = synthetic_coefficients(options, centre, channel);
        c.reduced_scattering.push_back(here.reduced_scattering);
        c.absorption.push_back(here.absorption);
      }
    }
  }
  return diffusion::make_medium(block, c, boundary);
}

// Radiance along the normal of z_max, on the coarse cells.
void observe(const diffusion::Medium& medium,
             const diffusion::Boundary& boundary,
             std::span<const double> phi,
             double ior,
             int channel,
             Image<float>& picture) {
  const double gain = diffusion::camera_equation(ior, boundary, 1.0).flux_gain;
  std::vector<double> flux(medium.block.face_cell_count(Face::kZMax));
  diffusion::net_flux(medium, boundary, Face::kZMax, phi, {}, {}, flux);
  for (int j = 0; j < medium.block.ny; ++j) {
    for (int i = 0; i < medium.block.nx; ++i) {
      picture.at(i / 2, j / 2, channel) +=
          static_cast<float>(0.25 * gain * flux[static_cast<std::size_t>(j) * medium.block.nx + i]);
    }
  }
}

void add_noise(const SyntheticOptions& options, std::mt19937& random, Illumination& i) {
  const float brightest =
      *std::max_element(i.radiance.samples().begin(), i.radiance.samples().end());
  for (std::size_t s = 0; s < i.radiance.samples().size(); ++s) {
    float& l = i.radiance.samples()[s];
    const double sigma = options.noise * std::hypot(l, 0.1 * brightest);
    i.radiance_variance.samples()[s] = static_cast<float>(std::max(sigma * sigma, 1e-20));
    if (sigma > 0.0) l += static_cast<float>(std::normal_distribution<double>(0.0, sigma)(random));
  }
}

Illumination dark(const Block& block, std::string name, bool held_out, Image<float> light) {
  return {.name = std::move(name),
          .held_out = held_out,
          .irradiance = std::move(light),
          .radiance = Image<float>(block.nx, block.ny, kColorChannels),
          .radiance_variance = Image<float>(block.nx, block.ny, kColorChannels),
          .mask = Image<std::uint8_t>(block.nx, block.ny, 1, 1)};
}

}  // namespace

Coefficients synthetic_coefficients(const SyntheticOptions& options, Vec3 p, int channel) {
  if (options.coefficients) return options.coefficients(p, channel);
  const double scattering = 1.0 + 0.3 * channel;
  const double absorption = 0.01 * (1 + channel);
  const Vec3 size = options.block.size();
  if (!options.heterogeneous) {
    const bool changed = options.layered && p.z > 0.5 * size.z;
    return {scattering * (changed ? 0.5 : 1.0), absorption * (changed ? 3.0 : 1.0)};
  }
  const double wave =
      std::sin(9.0 * p.x / size.x) * std::cos(7.0 * p.y / size.y + 3.0 * p.z / size.z);
  const bool vein = std::abs(p.x - p.y) < 0.15 * size.x;
  return {scattering * std::exp(0.5 * wave), absorption * (vein ? 3.0 : 1.0)};
}

Dataset make_synthetic_dataset(const SyntheticOptions& options) {
  const Block& block = options.block;
  Dataset dataset;
  dataset.block = block;
  dataset.ior = options.ior;
  dataset.view_cosine = Image<float>(block.nx, block.ny, 1, 1.0F);
  const Vec3 size = block.size();
  const int n = options.regions;
  const Block fine = finer(block);
  std::vector<Image<float>> fine_light;
  const auto add = [&](const std::string& name, bool held_out, double x, double y) {
    const double dx = size.x / n;
    const double dy = size.y / n;
    dataset.illuminations.push_back(
        dark(block, name, held_out, region(block, x * dx, y * dy, dx, dy)));
    fine_light.push_back(region(fine, x * dx, y * dy, dx, dy));
  };
  for (int k = 0; k < n * n; ++k) {
    const int row = k / n;
    add("region_" + std::to_string(k), false, k % n, row);
  }
  for (int k = 0; k < (n - 1) * (n - 1); ++k) {
    const int row = k / (n - 1);
    add("held_out_" + std::to_string(k), true, k % (n - 1) + 0.5, row + 0.5);
  }
  const auto boundary =
      *diffusion::make_boundary(diffusion::BoundaryModel::kTwoMoment, options.ior);
  for (int channel = 0; channel < kColorChannels; ++channel) {
    const diffusion::Medium medium = fine_medium(options, channel, boundary);
    const diffusion::FaceSource light(
        medium, boundary, Face::kZMin, {.deposit = diffusion::Deposit::kCell});
    DirectSolver solver;
    if (!solver.prepare(medium)) continue;
    for (std::size_t m = 0; m < fine_light.size(); ++m) {
      std::vector<double> q;
      for (std::size_t f = 0; f < fine_light[m].pixel_count(); ++f) {
        q.push_back((1.0 - diffusion::normal_reflectance(options.ior)) *
                    fine_light[m].samples()[f * kColorChannels]);
      }
      diffusion::FieldBatch b(fine.cell_count(), 1);
      diffusion::FieldBatch phi(fine.cell_count(), 1);
      light.deposit(q, b.values);
      if (!solver.solve(b, phi, {}, {})) continue;
      observe(
          medium, boundary, phi.values, options.ior, channel, dataset.illuminations[m].radiance);
    }
  }
  std::mt19937 random(options.seed);
  for (Illumination& i : dataset.illuminations) add_noise(options, random, i);
  return dataset;
}

}  // namespace opaline::testing_support
