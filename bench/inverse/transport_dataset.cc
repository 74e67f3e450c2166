#include "bench/inverse/transport_dataset.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "base/face_view.h"
#include "sim/light_transport.h"

namespace opaline::bench {
namespace {

struct Rectangle {  // of patches
  int x = 0;
  int y = 0;
  int width = 1;
  int height = 1;
  bool holds(int px, int py) const {
    return px >= x && px < x + width && py >= y && py < y + height;
  }
};

Image<float> irradiance(const TransportResponses& t, const Rectangle& lit) {
  const int width = t.block.face_width(t.lit_face);
  const int height = t.block.face_height(t.lit_face);
  Image<float> light(width, height, kColorChannels);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      if (!lit.holds(x * t.patches_x / width, y * t.patches_y / height)) continue;
      for (int c = 0; c < kColorChannels; ++c) light.at(x, y, c) = 1.0F;
    }
  }
  return light;
}

Illumination illumination(const TransportResponses& t,
                          std::string name,
                          bool held_out,
                          const Rectangle& lit) {
  const auto& shape = t.patches.front().radiance;
  Image<float> radiance(shape.width(), shape.height(), kColorChannels);
  Image<float> variance = radiance;
  for (int py = lit.y; py < lit.y + lit.height; ++py) {
    for (int px = lit.x; px < lit.x + lit.width; ++px) {
      const PatchResponse& patch = t.patch(px, py);
      for (std::size_t s = 0; s < radiance.samples().size(); ++s) {
        radiance.samples()[s] += patch.radiance.samples()[s];
        variance.samples()[s] += patch.variance.samples()[s];
      }
    }
  }
  return {.name = std::move(name),
          .held_out = held_out,
          .irradiance = irradiance(t, lit),
          .radiance = std::move(radiance),
          .radiance_variance = std::move(variance),
          .mask = Image<std::uint8_t>(shape.width(), shape.height(), 1, 1)};
}

// Adds relative noise, with a floor of a thousandth of the brightest datum as a camera's read noise has.
void add_noise(double noise, std::mt19937& random, Illumination& i) {
  auto radiance = i.radiance.samples();
  const double floor = 1e-3 * noise * *std::max_element(radiance.begin(), radiance.end());
  for (std::size_t s = 0; s < radiance.size(); ++s) {
    const double sigma = noise * radiance[s] + floor;
    i.radiance_variance.samples()[s] += static_cast<float>(sigma * sigma);
    radiance[s] += static_cast<float>(std::normal_distribution<double>(0.0, sigma)(random));
  }
}

Dataset empty_dataset(const TransportResponses& t) {
  Dataset dataset;
  dataset.block = t.block;
  dataset.ior = t.ior;
  dataset.lit_face = t.lit_face;
  dataset.seen_face = t.seen_face;
  FaceView view = view_of_face(t.block, t.seen_face, t.camera_centre);
  dataset.view_cosine = std::move(view.cosine);
  if (t.generator == sim::transport_generator())  // finite elements see the surface
    dataset.view_direction = std::move(view.direction);
  return dataset;
}

}  // namespace

Dataset dataset_from_transport(const TransportResponses& t,
                               const TransportDatasetOptions& options) {
  Dataset dataset = empty_dataset(t);
  const int n = options.regions;
  const int w = t.patches_x / n;  // at least one patch
  const int h = t.patches_y / n;
  const auto add = [&](const char* kind, bool held_out, const Rectangle& lit) {
    if (lit.x + lit.width > t.patches_x || lit.y + lit.height > t.patches_y) return;
    dataset.illuminations.push_back(
        illumination(t, fmt::format("{}_{}_{}", kind, lit.x, lit.y), held_out, lit));
  };
  for (int k = 0; k < n * n; ++k) add("region", false, {k % n * w, k / n * h, w, h});
  for (int k = 0; k < (n - 1) * (n - 1); k += 2) {
    add("shifted", true, {k % (n - 1) * w + w / 2, k / (n - 1) * h + h / 2, w, h});
  }
  for (int k = 0; k < 2; ++k) add("larger", true, {k * w, k * h, 2 * w, 2 * h});
  for (int k = 1; k < 4; ++k)
    add("smaller", true, {k * t.patches_x / 4, k * t.patches_y / 5, 1, 1});
  std::mt19937 random(options.seed);
  for (Illumination& i : dataset.illuminations) add_noise(options.noise, random, i);
  return dataset;
}

Dataset patch_dataset(const TransportResponses& t) {
  Dataset dataset = empty_dataset(t);
  for (int y = 0; y < t.patches_y; ++y) {
    for (int x = 0; x < t.patches_x; ++x) {
      dataset.illuminations.push_back(
          illumination(t, fmt::format("patch_{}_{}", x, y), true, {x, y, 1, 1}));
      for (float& v : dataset.illuminations.back().radiance_variance.samples())
        v = std::max(v, 1e-30F);
    }
  }
  return dataset;
}

}  // namespace opaline::bench
