#include "daemon/scattering/start_material.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/io/volume_io.h"
#include "daemon/scattering/sphere_maps.h"

namespace opaline::daemon {
namespace {

constexpr double kLeastAbsorption = 1e-5;  // 1/mm: its logarithm must exist

double geometric_mean(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) sum += std::log(std::max(value, kLeastAbsorption));
  return std::exp(sum / static_cast<double>(values.size()));
}

}  // namespace

Result<std::array<reconstruct::StartCoefficients, kColorChannels>> read_start(
    const std::filesystem::path& path) {
  std::array<reconstruct::StartCoefficients, kColorChannels> start;
  if (path.extension() == ".vdb") {
    const auto material = read_material(path);
    if (!material) return material.error().in("reconstruction.start");
    for (std::size_t c = 0; c < start.size(); ++c)
      start[c] = {geometric_mean(material->channels[c].reduced_scattering),
                  geometric_mean(material->channels[c].absorption)};
    return start;
  }
  const auto maps = read_maps_file(path.extension() == ".exr" ? path : path / "maps.exr");
  if (!maps) return maps.error().in("reconstruction.start");
  for (std::size_t c = 0; c < start.size(); ++c) {
    const reconstruct::ScatteringMaps& m = maps->channels[c];
    start[c] = {median_of(m, m.reduced_scattering),
                std::max(kLeastAbsorption, median_of(m, m.absorption))};
    if (!std::isfinite(start[c].reduced_scattering) || !std::isfinite(start[c].absorption))
      return invalid_argument(fmt::format(
          "reconstruction.start: {} has no answer in {}", path.string(), kChannelNames[c]));
  }
  return start;
}

}  // namespace opaline::daemon
