#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <numbers>

#include "sim/light_transport.h"

namespace opaline::sim {
namespace {

constexpr const char* kGenerator =
    "opaline sim/light_transport 1 (delta tracking, local estimation; xoshiro128+, SplitMix64)";

TransportOptions channel_options(const ResponseOptions& options, int column, int row, int channel) {
  const auto patch = static_cast<std::uint64_t>(row) * options.patches_x + column;
  return {.photons = options.photons_per_patch,
          .seed = options.seed,
          .stream = patch * kColorChannels + channel,
          .anisotropy = options.anisotropy,
          .tally_exitance = false,
          .radiance = RadianceTally{options.seen_face, options.camera_centre},
          .threads = options.threads};
}

void set_channel(Image<float>& image, const Image<double>& values, int channel) {
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      image.at(x, y, channel) = static_cast<float>(values.at(x, y));
    }
  }
}

void average(Image<float>& to, const Image<float>& other, double weight, double other_weight) {
  for (std::size_t i = 0; i < to.samples().size(); ++i) {
    to.samples()[i] =
        static_cast<float>(weight * to.samples()[i] + other_weight * other.samples()[i]);
  }
}

}  // namespace

std::string_view transport_generator() { return kGenerator; }

Result<void> validate(const ResponseOptions& options, const Material& material) {
  for (const int patches : {options.patches_x, options.patches_y}) {
    if (patches < 1 || patches > 256) {
      return invalid_argument(fmt::format("{} patches; expected 1 to 256", patches));
    }
  }
  if (!std::isfinite(length(options.camera_centre))) {
    return invalid_argument("the camera's centre is not a point");
  }
  if (material.block.cell_count() != material.channels[0].absorption.size()) {
    return invalid_argument("the material's grids do not fit its block");
  }
  return ok();
}

Vec3 camera_above(const Block& block, double distance_mm, double degrees) {
  const double angle = degrees * std::numbers::pi / 180.0;
  const Vec3 size = block.size();
  return {0.5 * size.x + distance_mm * std::sin(angle),
          0.5 * size.y,
          size.z + distance_mm * std::cos(angle)};
}

Result<PatchResponse> patch_response(const Material& material,
                                     const ResponseOptions& options,
                                     int column,
                                     int row,
                                     std::stop_token stop) {
  const Block& block = material.block;
  const int width = block.face_width(options.seen_face);
  const int height = block.face_height(options.seen_face);
  PatchResponse response{Image<float>(width, height, kColorChannels),
                         Image<float>(width, height, kColorChannels)};
  LightEntry entry =
      patch_of_face(block, options.lit_face, options.patches_x, options.patches_y, column, row);
  entry.diffuse = options.diffuse_entry;
  for (int channel = 0; channel < kColorChannels; ++channel) {
    const auto tally = trace(block,
                             material.ior,
                             material.channels[channel],
                             entry,
                             channel_options(options, column, row, channel),
                             stop);
    if (!tally) return tally.error().in(fmt::format("channel {}", kChannelNames[channel]));
    set_channel(response.radiance, tally->radiance.mean, channel);
    set_channel(response.variance, tally->radiance.variance, channel);
  }
  return response;
}

Result<TransportResponses> compute_responses(const Material& material,
                                             const ResponseOptions& options,
                                             std::string scene,
                                             EventSink& events,
                                             std::stop_token stop) {
  if (auto valid = validate(options, material); !valid) return valid.error();
  TransportResponses responses{.block = material.block,
                               .ior = material.ior,
                               .lit_face = options.lit_face,
                               .seen_face = options.seen_face,
                               .diffuse_entry = options.diffuse_entry,
                               .patches_x = options.patches_x,
                               .patches_y = options.patches_y,
                               .camera_centre = options.camera_centre,
                               .anisotropy = options.anisotropy,
                               .seed = options.seed,
                               .photons_per_patch = whole_batches(options.photons_per_patch),
                               .generator = kGenerator,
                               .scene = std::move(scene),
                               .patches = {}};
  const int count = options.patches_x * options.patches_y;
  const auto start = std::chrono::steady_clock::now();
  for (int i = 0; i < count; ++i) {
    const int column = i % options.patches_x;
    const int row = i / options.patches_x;
    auto patch = patch_response(material, options, column, row, stop);
    if (!patch) return patch.error().in(fmt::format("patch {} of {}", i + 1, count));
    responses.patches.push_back(*std::move(patch));
    const double fraction = (i + 1.0) / count;
    const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - start;
    events.progress({.step = "light transport",
                     .fraction = fraction,
                     .seconds_left = spent.count() * (1.0 - fraction) / fraction,
                     .detail = {{"patch", i + 1}, {"patches", count}}});
  }
  return responses;
}

Result<TransportResponses> combine(const TransportResponses& first,
                                   const TransportResponses& next) {
  TransportResponses expected = first;  // with what may differ taken from `next`
  expected.seed = first.seed + first.passes;
  expected.passes = next.passes;
  expected.photons_per_patch = next.photons_per_patch;
  expected.patches = next.patches;
  if (expected != next ||
      first.photons_per_patch * next.passes != next.photons_per_patch * first.passes) {
    return invalid_argument(
        fmt::format("runs of different samples, options or photons, or seeds not in sequence: {} "
                    "passes from seed {}, then seed {}",
                    first.passes,
                    first.seed,
                    next.seed));
  }
  TransportResponses both = first;
  both.passes += next.passes;
  both.photons_per_patch += next.photons_per_patch;
  const double a = static_cast<double>(first.passes) / both.passes;
  const double b = 1.0 - a;
  for (std::size_t i = 0; i < both.patches.size(); ++i) {
    average(both.patches[i].radiance, next.patches[i].radiance, a, b);
    average(both.patches[i].variance, next.patches[i].variance, a * a, b * b);
  }
  return both;
}

}  // namespace opaline::sim
