#include "daemon/scattering/sphere_maps.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <thread>
#include <utility>

#include "base/clock.h"
#include "base/io/image_io.h"
#include "base/material.h"
#include "daemon/report/step_progress.h"

namespace opaline::daemon {
namespace {

using reconstruct::BallTable;
using reconstruct::LeftOut;
using reconstruct::ScatteringMaps;

constexpr const char* kFile = "maps.exr";
constexpr std::array<const char*, 3> kColors{"R", "G", "B"};

struct Layer {
  const char* name;
  const char* unit;
  std::vector<float> ScatteringMaps::*values;
};
constexpr std::array<Layer, 11> kLayers{
    Layer{"reduced_albedo", "1", &ScatteringMaps::reduced_albedo},
    Layer{"reduced_albedo_sd", "1", &ScatteringMaps::albedo_deviation},
    Layer{"diffusion", "mm", &ScatteringMaps::diffusion},
    Layer{"diffusion_log_sd", "1", &ScatteringMaps::log_diffusion_deviation},
    Layer{"translucency", "mm", &ScatteringMaps::translucency},
    Layer{"reduced_scattering", "1/mm", &ScatteringMaps::reduced_scattering},
    Layer{"absorption", "1/mm", &ScatteringMaps::absorption},
    Layer{"normal_x", "1", &ScatteringMaps::normal_x},
    Layer{"normal_y", "1", &ScatteringMaps::normal_y},
    Layer{"normal_z", "1", &ScatteringMaps::normal_z},
    Layer{"curvature", "1/mm", &ScatteringMaps::curvature}};

std::vector<std::string> channel_names(bool specular) {
  std::vector<std::string> names;
  for (const Layer& layer : kLayers)
    for (const char* color : kColors) names.push_back(fmt::format("{}.{}", layer.name, color));
  for (const char* color : kColors) names.push_back(fmt::format("left_out.{}", color));
  if (specular)
    for (const char* color : kColors) names.push_back(fmt::format("specular.{}", color));
  return names;
}

reconstruct::MapOptions map_options(const config::LedSphereOptions& o, std::size_t lamps) {
  reconstruct::MapOptions options;
  options.half_windows.clear();
  for (int half = 2; half < o.largest_window; half *= 2) options.half_windows.push_back(half);
  options.half_windows.push_back(o.largest_window);
  options.certain = o.certain;
  options.sigmas = o.sigmas;
  options.shared = reconstruct::shared_deviations(
      o.lamp_deviation, static_cast<double>(lamps), o.white_deviation);
  options.ior = o.ior;
  return options;
}

double quantile(std::vector<float> values, double share) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  const auto at = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::ranges::nth_element(values, values.begin() + at);
  return values[static_cast<std::size_t>(at)];
}

std::vector<float> found_in(const ScatteringMaps& maps, const std::vector<float>& values) {
  std::vector<float> found;
  for (std::size_t at = 0; at < values.size(); ++at)
    if (maps.left_out[at] == LeftOut::kFound) found.push_back(values[at]);
  return found;
}

}  // namespace

Result<SphereMaps> find_maps(const SphereSession& session,
                             const config::LedSphereOptions& options,
                             int threads,
                             EventSink& events,
                             std::stop_token stop) {
  const SystemClock clock;
  StepProgress progress(events, clock, "scattering maps");
  const unsigned cores = std::max(1U, std::thread::hardware_concurrency());
  ThreadTeam team(threads > 0 ? threads : static_cast<int>(cores));
  const auto table = BallTable::of_index(options.ior);
  if (!table) return table.error().in("led_sphere.ior");
  const auto lower = BallTable::of_index(std::max(1.3, options.ior - options.ior_deviation));
  const auto higher = BallTable::of_index(std::min(1.5, options.ior + options.ior_deviation));
  if (!lower || !higher) return !lower ? lower.error() : higher.error();
  reconstruct::MapOptions how = map_options(options, shining_lamps(session.record));
  if (options.ior_deviation > 0.0) {
    how.lower_index = &*lower;
    how.higher_index = &*higher;
  }
  SphereMaps maps{{}, specular_map(session)};
  for (int c = 0; c < 3; ++c) {
    if (stop.stop_requested()) return cancelled("scattering maps: stopped");
    const auto ideal = reconstruct::ideal_pictures(
        channel_pictures(session, c), session.record, options.ior, team);
    if (!ideal) return ideal.error();
    progress.done((c + 0.5) / 3.0);
    if (stop.stop_requested()) return cancelled("scattering maps: stopped");
    auto found = reconstruct::estimate_scattering(*ideal, *table, how, team);
    if (!found) return found.error();
    maps.channels[static_cast<std::size_t>(c)] = *std::move(found);
    progress.done((c + 1.0) / 3.0);
  }
  return maps;
}

Result<void> write_maps(FileOperations& files,
                        const SessionDirectory& session,
                        const SphereMaps& maps) {
  const auto names = channel_names(maps.specular.has_value());
  const ScatteringMaps& first = maps.channels[0];
  Image<float> pixels(first.width, first.height, static_cast<int>(names.size()));
  const std::size_t stride = names.size();
  for (std::size_t at = 0; at < first.left_out.size(); ++at) {
    float* to = &pixels.samples()[at * stride];
    for (const Layer& layer : kLayers)
      for (const ScatteringMaps& channel : maps.channels) *to++ = (channel.*layer.values)[at];
    for (const ScatteringMaps& channel : maps.channels)
      *to++ = static_cast<float>(channel.left_out[at]);
    if (maps.specular)
      for (std::size_t c = 0; c < 3; ++c) *to++ = maps.specular->samples()[3 * at + c];
  }
  ImageFile file{std::move(pixels), names, {}};
  for (const Layer& layer : kLayers) file.metadata[fmt::format("unit.{}", layer.name)] = layer.unit;
  for (int reason = 0; reason <= reconstruct::kLastReason; ++reason)
    file.metadata[fmt::format("left_out.{}", reason)] =
        std::string(reconstruct::to_string(static_cast<LeftOut>(reason)));
  const auto bytes = encode_image(file, ImageFormat::kExr);
  if (!bytes) return bytes.error().in(kFile);
  return write_whole(files, session.path() / kFile, *bytes);
}

Result<SphereMaps> read_maps(const SessionDirectory& session) {
  return read_maps_file(session.path() / kFile);
}

Result<SphereMaps> read_maps_file(const std::filesystem::path& path) {
  const auto bytes = read_bytes(path, std::size_t{4} << 30);
  if (!bytes) return bytes.error();
  const auto file = decode_image(*bytes);
  if (!file) return file.error().in(path.string());
  const bool specular = std::ranges::find(file->channels, "specular.R") != file->channels.end();
  const auto names = channel_names(specular);
  const auto pixels = select_channels(*file, names);
  if (!pixels) return pixels.error().in(path.string());
  SphereMaps maps;
  if (specular) maps.specular = Image<float>(pixels->width(), pixels->height(), 3);
  for (ScatteringMaps& channel : maps.channels) {
    channel.width = pixels->width();
    channel.height = pixels->height();
  }
  for (std::size_t at = 0; at < pixels->pixel_count(); ++at) {
    const float* from = &pixels->samples()[at * names.size()];
    for (const Layer& layer : kLayers)
      for (ScatteringMaps& channel : maps.channels) (channel.*layer.values).push_back(*from++);
    for (ScatteringMaps& channel : maps.channels) {
      const int reason =
          std::clamp(static_cast<int>(std::lround(*from++)), 0, reconstruct::kLastReason);
      channel.left_out.push_back(static_cast<LeftOut>(reason));
    }
    if (specular)
      for (std::size_t c = 0; c < 3; ++c) maps.specular->samples()[3 * at + c] = *from++;
  }
  return maps;
}

double median_of(const ScatteringMaps& maps, const std::vector<float>& values) {
  return quantile(found_in(maps, values), 0.5);
}

nlohmann::ordered_json maps_summary(const SphereMaps& maps,
                                    const SphereSession& session,
                                    const config::LedSphereOptions& options) {
  auto channels = nlohmann::ordered_json::array();
  for (std::size_t c = 0; c < 3; ++c) {
    const ScatteringMaps& m = maps.channels[c];
    nlohmann::ordered_json channel{{"channel", kChannelNames[c]}};
    const auto put = [&](const char* name, const std::vector<float>& values) {
      const std::vector<float> found = found_in(m, values);
      if (found.empty()) return;  // JSON has no NaN
      channel[name] = {{"median", quantile(found, 0.5)},
                       {"lower_quartile", quantile(found, 0.25)},
                       {"upper_quartile", quantile(found, 0.75)}};
    };
    put("reduced_albedo", m.reduced_albedo);
    put("diffusion_mm", m.diffusion);
    put("translucency_mm", m.translucency);
    put("reduced_scattering_per_mm", m.reduced_scattering);
    put("absorption_per_mm", m.absorption);
    put("diffusion_log_sd", m.log_diffusion_deviation);
    nlohmann::ordered_json reasons = nlohmann::ordered_json::object();
    for (int reason = 0; reason <= reconstruct::kLastReason; ++reason) {
      std::size_t count = 0;
      for (std::size_t at = 0; at < m.left_out.size(); ++at)
        if (session.measured.samples()[at] != reconstruct::kNotSeen &&
            static_cast<int>(m.left_out[at]) == reason)
          ++count;
      reasons[std::string(reconstruct::to_string(static_cast<LeftOut>(reason)))] = count;
    }
    channel["pixels"] = reasons;
    channels.push_back(std::move(channel));
  }
  return {{"kind", "led_sphere"},
          {"channels", channels},
          {"lamps", shining_lamps(session.record)},
          {"drift", session.record.drift},
          {"pixel_mm", session.record.pixel_mm},
          {"ior", options.ior},
          {"ior_deviation", options.ior_deviation}};
}

Image<float> mean_normals(const SphereMaps& maps) {
  const ScatteringMaps& first = maps.channels[0];
  Image<float> normals(first.width, first.height, 3);
  for (std::size_t at = 0; at < first.left_out.size(); ++at) {
    std::array<double, 3> sum{};
    for (const ScatteringMaps& m : maps.channels) {
      sum[0] += m.normal_x[at];
      sum[1] += m.normal_y[at];
      sum[2] += m.normal_z[at];
    }
    const double length = std::hypot(sum[0], sum[1], sum[2]);
    if (!(length > 0.0)) continue;
    for (std::size_t k = 0; k < 3; ++k)
      normals.samples()[3 * at + k] = static_cast<float>(sum[k] / length);
  }
  return normals;
}

}  // namespace opaline::daemon
