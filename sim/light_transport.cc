#include "sim/light_transport.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <optional>
#include <span>
#include <thread>
#include <vector>

#include "sim/camera_connection.h"
#include "sim/light_transport_medium.h"
#include "sim/photon_batch.h"

namespace opaline::sim {
namespace {

constexpr std::uint64_t kFewestBatches = 8;
constexpr std::uint64_t kMostParts = 64;
constexpr std::uint64_t kFewestParts = 8;
constexpr std::size_t kMostPartBytes =
    std::size_t{256} << 20;  // of all parts together, while there are more than that
constexpr double kLeastOpticalThickness = 1e-3;

/// Running sums of one quantity over batches, and of squares for the scatter between them.
struct Moments {
  std::vector<double> sum;
  std::vector<double> square;
  explicit Moments(std::size_t count = 0) : sum(count), square(count) {}
  void add(std::span<const double> values) {
    for (std::size_t i = 0; i < values.size(); ++i) {
      sum[i] += values[i];
      square[i] += values[i] * values[i];
    }
  }
  void add(const Moments& other) {
    for (std::size_t i = 0; i < sum.size(); ++i) {
      sum[i] += other.sum[i];
      square[i] += other.square[i];
    }
  }
  TallyValue value(std::size_t i, std::uint64_t batches, double scale) const {
    const double count = static_cast<double>(batches);
    const double mean = sum[i] / count;
    const double scatter = std::max(0.0, square[i] / count - mean * mean) * count / (count - 1.0);
    return {mean * scale, scatter / count * scale * scale};
  }
};

constexpr std::size_t kScalars = 9;  // specular, absorbed, unscattered, six faces

struct PartSums {
  Moments scalars{kScalars};
  std::array<Moments, 6> exitance;
  Moments radiance;

  PartSums(const Block& block, const TransportOptions& options) {
    if (options.tally_exitance) {
      for (const Face face : kFaces) {
        exitance[static_cast<std::size_t>(face)] = Moments(block.face_cell_count(face));
      }
    }
    if (options.radiance) radiance = Moments(block.face_cell_count(options.radiance->face));
  }
  void add(const BatchSums& batch) {
    std::array<double, kScalars> values{batch.specular, batch.absorbed, batch.unscattered};
    std::copy(batch.escaped.begin(), batch.escaped.end(), values.begin() + 3);
    scalars.add(values);
    for (std::size_t face = 0; face < 6; ++face) exitance[face].add(batch.exitance[face]);
    radiance.add(batch.radiance);
  }
  void add(const PartSums& part) {
    scalars.add(part.scalars);
    for (std::size_t face = 0; face < 6; ++face) exitance[face].add(part.exitance[face]);
    radiance.add(part.radiance);
  }
};

BatchSums make_batch_sums(const Block& block, const TransportOptions& options) {
  BatchSums sums;
  if (options.tally_exitance) {
    for (const Face face : kFaces) {
      sums.exitance[static_cast<std::size_t>(face)].resize(block.face_cell_count(face));
    }
  }
  if (options.radiance) sums.radiance.resize(block.face_cell_count(options.radiance->face));
  return sums;
}

std::uint64_t batch_key(const TransportOptions& options, std::uint64_t batch) {
  SplitMix seed(options.seed);
  SplitMix stream(seed.next() ^ options.stream);
  SplitMix key(stream.next() ^ batch);
  return key.next();
}

PartSums trace_part(const BatchSetup& setup,
                    const TransportOptions& options,
                    std::uint64_t first,
                    std::uint64_t last,
                    const std::stop_token& stop) {
  PartSums part(setup.medium.block, options);
  BatchSums batch = make_batch_sums(setup.medium.block, options);
  for (std::uint64_t i = first; i < last && !stop.stop_requested(); ++i) {
    batch.clear();
    trace_batch(setup, batch_key(options, i), batch);
    part.add(batch);
  }
  return part;
}

/// How many parts: for large faces fewer, since each keeps sums of its own until all are done.
std::uint64_t part_count(const Block& block,
                         const TransportOptions& options,
                         std::uint64_t batches) {
  std::size_t cells = options.radiance ? block.face_cell_count(options.radiance->face) : 0;
  for (const Face face : kFaces) {
    if (options.tally_exitance) cells += block.face_cell_count(face);
  }
  const std::size_t part_bytes = 2 * sizeof(double) * (cells + kScalars);
  return std::min(batches,
                  std::clamp<std::uint64_t>(kMostPartBytes / part_bytes, kFewestParts, kMostParts));
}

/// The parts are the same for any number of threads; threads take the next one not taken.
PartSums trace_parts(const BatchSetup& setup,
                     const TransportOptions& options,
                     std::uint64_t batches,
                     const std::stop_token& stop) {
  const std::uint64_t parts = part_count(setup.medium.block, options, batches);
  std::vector<std::optional<PartSums>> done(parts);
  std::atomic<std::uint64_t> next{0};
  const auto work = [&] {
    for (std::uint64_t i = next++; i < parts; i = next++) {
      done[i] = trace_part(setup, options, i * batches / parts, (i + 1) * batches / parts, stop);
    }
  };
  const unsigned processors = std::max(1U, std::thread::hardware_concurrency());
  const unsigned threads = options.threads > 0 ? options.threads : processors;
  {
    std::vector<std::jthread> helpers;
    for (unsigned i = 1; i < threads && i < parts; ++i) helpers.emplace_back(work);
    work();
  }
  PartSums total(setup.medium.block, options);
  for (const std::optional<PartSums>& part : done) total.add(*part);
  return total;
}

TallyImage image_of(
    const Moments& moments, int width, int height, std::uint64_t batches, double scale) {
  TallyImage image{Image<double>(width, height, 1), Image<double>(width, height, 1)};
  for (std::size_t i = 0; i < moments.sum.size(); ++i) {
    const TallyValue value = moments.value(i, batches, scale);
    image.mean.samples()[i] = value.mean;
    image.variance.samples()[i] = value.variance;
  }
  return image;
}

TransportTally tally_of(const PartSums& sums,
                        const Block& block,
                        const TransportOptions& options,
                        double incident,
                        std::uint64_t batches) {
  const double watts = incident / static_cast<double>(kBatchPhotons);  // a photon's, in a batch
  TransportTally tally;
  tally.photons = batches * kBatchPhotons;
  tally.incident = incident;
  tally.specular = sums.scalars.value(0, batches, watts);
  tally.absorbed = sums.scalars.value(1, batches, watts);
  tally.unscattered = sums.scalars.value(2, batches, watts);
  for (const Face face : kFaces) {
    const auto i = static_cast<std::size_t>(face);
    tally.escaped[i] = sums.scalars.value(3 + i, batches, watts);
    if (!options.tally_exitance) continue;
    const double scale = watts / block.face_cell_area(face);
    tally.exitance[i] =
        image_of(sums.exitance[i], block.face_width(face), block.face_height(face), batches, scale);
  }
  if (options.radiance) {
    const Face seen = options.radiance->face;
    tally.radiance =
        image_of(sums.radiance, block.face_width(seen), block.face_height(seen), batches, watts);
  }
  return tally;
}

Result<void> validate_medium(const Block& block,
                             double ior,
                             const ChannelCoefficients& coefficients) {
  const std::size_t count = block.cell_count();
  if (block.nx < 1 || block.ny < 1 || block.nz < 1 || !(block.cell_volume() > 0.0)) {
    return invalid_argument("a block needs at least one cell of positive size in each direction");
  }
  if (!(ior >= 1.0 && ior <= 3.0))
    return invalid_argument(fmt::format("ior = {}; expected 1 to 3", ior));
  if (coefficients.absorption.size() != count || coefficients.reduced_scattering.size() != count) {
    return invalid_argument(fmt::format("expected {} coefficients, one a voxel", count));
  }
  double most = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    const double a = coefficients.absorption[i];
    const double s = coefficients.reduced_scattering[i];
    if (!(a >= 0.0 && s > 0.0 && std::isfinite(a) && std::isfinite(s))) {
      return invalid_argument(fmt::format(
          "voxel {}: absorption {} and scattering {} /mm; expected >= 0 and > 0", i, a, s));
    }
    most = std::max(most, a + s);
  }
  const Vec3 size = block.size();
  if (most * std::min({size.x, size.y, size.z}) < kLeastOpticalThickness) {
    return invalid_argument("the block is almost clear: no light would ever scatter in it");
  }
  return ok();
}

Result<void> validate_entry(const Block& block, const LightEntry& entry) {
  const int axis = axis_of(entry.face);
  const std::array<double, 3> size{block.size().x, block.size().y, block.size().z};
  const double columns = size[axis == 0 ? 1 : 0];
  const double rows = size[axis == 2 ? 1 : 2];
  const double slack = 1e-9 * (columns + rows);
  const bool inside = entry.column_begin >= -slack && entry.column_begin < entry.column_end &&
                      entry.column_end <= columns + slack && entry.row_begin >= -slack &&
                      entry.row_begin < entry.row_end && entry.row_end <= rows + slack;
  if (!inside) return invalid_argument("the entry rectangle must lie on its face and have an area");
  return ok();
}

Result<void> validate_options(const Block& block,
                              const LightEntry& entry,
                              const TransportOptions& options) {
  if (!(std::abs(options.anisotropy) <= 0.95)) {
    return invalid_argument(
        fmt::format("anisotropy = {}; expected -0.95 to 0.95", options.anisotropy));
  }
  if (options.photons < 1 || options.photons > (std::uint64_t{1} << 50)) {
    return invalid_argument(fmt::format("photons = {}; expected 1 to 2^50", options.photons));
  }
  if (options.threads < 0 || options.threads > 1024) {
    return invalid_argument(fmt::format("threads = {}; expected 0 to 1024", options.threads));
  }
  if (options.periodic_sides && axis_of(entry.face) != 2) {
    return invalid_argument("a slab is lit through a z face");
  }
  if (!options.radiance) return ok();
  const Face seen = options.radiance->face;
  if (options.periodic_sides && axis_of(seen) != 2)
    return invalid_argument("a slab is seen through a z face");
  const std::array<double, 3> size{block.size().x, block.size().y, block.size().z};
  const Vec3 c = options.radiance->centre;
  const std::array<double, 3> centre{c.x, c.y, c.z};
  const int axis = axis_of(seen);
  const double height = is_max(seen) ? centre[axis] - size[axis] : -centre[axis];
  if (!(height >= size[axis])) {
    return invalid_argument(fmt::format(
        "the camera is {} mm in front of face {}; expected at least the block's thickness, {} mm",
        height,
        to_string(seen),
        size[axis]));
  }
  return ok();
}

}  // namespace

std::uint64_t whole_batches(std::uint64_t photons) {
  return std::max(kFewestBatches, (photons + kBatchPhotons - 1) / kBatchPhotons) * kBatchPhotons;
}

LightEntry whole_face(const Block& block, Face face, bool diffuse) {
  LightEntry entry = patch_of_face(block, face, 1, 1, 0, 0);
  entry.diffuse = diffuse;
  return entry;
}

LightEntry patch_of_face(
    const Block& block, Face face, int patches_x, int patches_y, int column, int row) {
  const int axis = axis_of(face);
  const double width = block.face_width(face) * block.spacing()[axis == 0 ? 1 : 0];
  const double height = block.face_height(face) * block.spacing()[axis == 2 ? 1 : 2];
  return {.face = face,
          .column_begin = width * column / patches_x,
          .column_end = width * (column + 1) / patches_x,
          .row_begin = height * row / patches_y,
          .row_end = height * (row + 1) / patches_y};
}

Result<TransportTally> trace(const Block& block,
                             double ior,
                             const ChannelCoefficients& coefficients,
                             const LightEntry& entry,
                             const TransportOptions& options,
                             std::stop_token stop) {
  if (auto valid = validate_medium(block, ior, coefficients); !valid) return valid.error();
  if (auto valid = validate_entry(block, entry); !valid) return valid.error();
  if (auto valid = validate_options(block, entry, options); !valid) return valid.error();
  LightTransportMedium medium =
      make_medium(block, ior, coefficients, options.anisotropy, options.periodic_sides);
  std::optional<CameraConnection> camera;
  if (options.radiance) {
    thin_connections(medium, options.radiance->face);
    camera.emplace(medium, options.radiance->face, options.radiance->centre);
  }
  const BatchSetup setup{.medium = medium,
                         .entry = entry,
                         .count_unscattered = options.count_unscattered,
                         .camera = camera ? &*camera : nullptr,
                         .stop = stop};
  const std::uint64_t batches = whole_batches(options.photons) / kBatchPhotons;
  const PartSums sums = trace_parts(setup, options, batches, stop);
  if (stop.stop_requested()) return cancelled("light transport was stopped");
  const double incident =
      (entry.column_end - entry.column_begin) * (entry.row_end - entry.row_begin);
  return tally_of(sums, block, options, incident, batches);
}

}  // namespace opaline::sim
