#include "daemon/scattering/beam_measurement.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "daemon/scattering/relief.h"
#include "reconstruct/diffusion/fresnel.h"
#include "reconstruct/spherical_gradient/exit_law.h"

namespace opaline::daemon {
namespace {

using reconstruct::LeftOut;

constexpr int kMostRings = 60;
constexpr double kFirstRing = 2.0;  // mean free paths
constexpr double kLastRing = 8.0;   // l_d
constexpr int kSpotReach = 4;       // pixels
constexpr double kLeastPixels = 8;  // of a ring
/// What a ring's logarithm is uncertain by, beside its noise: the exit law and the relief.
constexpr double kRingDeviation = 0.03;

/// Places of the seen surface, mm, from its relief.
class Places {
 public:
  Places(const Relief& relief, const StageRecord& record) : relief_(relief), record_(record) {}
  std::optional<Vec3> at(double x, double y) const {
    const double u = x / relief_.step;
    const double v = y / relief_.step;
    const int i = static_cast<int>(u);
    const int j = static_cast<int>(v);
    if (!relief_.has(i, j) || !relief_.has(i + 1, j) || !relief_.has(i, j + 1) ||
        !relief_.has(i + 1, j + 1))
      return std::nullopt;
    const double a = u - i;
    const double b = v - j;
    const double height = (1.0 - b) * ((1.0 - a) * relief_.at(i, j) + a * relief_.at(i + 1, j)) +
                          b * ((1.0 - a) * relief_.at(i, j + 1) + a * relief_.at(i + 1, j + 1));
    return Vec3{x * record_.pixel_mm, y * record_.pixel_mm, height};
  }

 private:
  const Relief& relief_;
  const StageRecord& record_;
};

struct Spot {
  double x = 0.0;
  double y = 0.0;
};

/// The light's middle around the brightest pixel of the object.
Result<Spot> find_spot(const HdrPicture& picture, const Image<std::uint8_t>& measured) {
  const Image<float>& radiance = picture.radiance;
  int best_x = -1;
  int best_y = -1;
  float best = 0.0F;
  for (int y = 0; y < radiance.height(); ++y)
    for (int x = 0; x < radiance.width(); ++x)
      if (measured.at(x, y) != reconstruct::kNotSeen && radiance.at(x, y, 1) > best) {
        best = radiance.at(x, y, 1);
        best_x = x;
        best_y = y;
      }
  if (best_x < 0) return invalid_argument("the beam is not seen on the object");
  Spot spot;
  double sum = 0.0;
  for (int y = std::max(0, best_y - kSpotReach);
       y <= std::min(radiance.height() - 1, best_y + kSpotReach);
       ++y)
    for (int x = std::max(0, best_x - kSpotReach);
         x <= std::min(radiance.width() - 1, best_x + kSpotReach);
         ++x) {
      const double light = std::max(0.0F, radiance.at(x, y, 1));
      sum += light;
      spot.x += light * x;
      spot.y += light * y;
    }
  return Spot{spot.x / sum, spot.y / sum};
}

double median_of_values(std::vector<float> values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + std::ssize(values) / 2;
  std::ranges::nth_element(values, middle);
  return *middle;
}

/// Share of a beam that enters where it meets the surface.
double entering(const StageRecord& record,
                const config::BeamConfig& beam,
                const Image<float>& normals,
                Spot spot,
                double ior) {
  const Vec3 from{beam.position_mm[0] - beam.aim_mm[0],
                  beam.position_mm[1] - beam.aim_mm[1],
                  beam.position_mm[2] - beam.aim_mm[2]};
  const Vec3 back = normalized(from);
  double cosine = 0.0;
  for (std::size_t k = 0; k < 3; ++k)
    cosine += dot(back, record.axes[k]) * normals.at(static_cast<int>(std::lround(spot.x)),
                                                     static_cast<int>(std::lround(spot.y)),
                                                     static_cast<int>(k));
  return 1.0 - reconstruct::diffusion::fresnel_reflectance(std::clamp(cosine, 0.05, 1.0), ior);
}

/// Sums over the pixels of one ring.
struct Ring {
  double count = 0.0;
  double distance = 0.0;
  double exitance = 0.0;
  double variance = 0.0;
};

BeamChannel measure_channel(const reconstruct::ScatteringMaps& maps,
                            const HdrPicture& picture,
                            int channel,
                            const Image<float>& distances,
                            const Image<float>& units,
                            double ior) {
  BeamChannel out;
  const double translucency = median_of(maps, maps.translucency);
  const double diffusion = median_of(maps, maps.diffusion);
  if (!(translucency > 0.0)) {
    out.why_not = "the maps have no answer, so no mean free path is known";
    return out;
  }
  const double nearest = kFirstRing * 3.0 * diffusion;
  const double farthest = std::max(2.0 * nearest, kLastRing * translucency);
  const double width = (farthest - nearest) / kMostRings;
  std::vector<Ring> rings(kMostRings);
  std::array<std::vector<float>, 3> around;
  for (std::size_t at = 0; at < distances.pixel_count(); ++at) {
    const double distance = distances.samples()[at];
    if (!(distance >= 0.0 && distance < farthest)) continue;  // NaN: not seen
    if (maps.left_out[at] == LeftOut::kFound) {
      around[0].push_back(maps.translucency[at]);
      around[1].push_back(maps.diffusion[at]);
      around[2].push_back(maps.reduced_albedo[at]);
    }
    if (distance < nearest || picture.usable.samples()[at] == 0 ||
        picture.saturated.samples()[at] != 0)
      continue;
    Ring& ring = rings[static_cast<std::size_t>((distance - nearest) / width) % kMostRings];
    const double unit = units.samples()[at];
    const std::size_t sample = 3 * at + static_cast<std::size_t>(channel);
    ring.count += 1.0;
    ring.distance += distance;
    ring.exitance += unit * picture.radiance.samples()[sample];
    ring.variance += unit * unit * picture.variance.samples()[sample];
  }
  out.map_translucency = median_of_values(std::move(around[0]));
  out.map_diffusion = median_of_values(std::move(around[1]));
  out.map_albedo = median_of_values(std::move(around[2]));
  std::vector<double> weights;
  for (const Ring& ring : rings) {
    const double noise = std::sqrt(ring.variance) / std::max(1e-300, ring.exitance);
    if (ring.count < kLeastPixels || !(ring.exitance > 0.0) || noise > 0.5) continue;
    out.distance_mm.push_back(ring.distance / ring.count);
    out.exitance.push_back(ring.exitance / ring.count);
    out.deviation.push_back(std::hypot(noise, kRingDeviation));
    weights.push_back(1.0 / (out.deviation.back() * out.deviation.back()));
  }
  const auto found = reconstruct::fit_beam(out.distance_mm, out.exitance, weights, ior);
  if (found) {
    out.found = *found;
  } else {
    out.why_not = found.error().message;
  }
  return out;
}

}  // namespace

Result<std::optional<BeamMeasurement>> measure_beam(const SphereMaps& maps,
                                                    const SphereSession& session,
                                                    const config::BeamConfig& beam,
                                                    double ior) {
  const auto shown = session.pictures.find("beam");
  if (shown == session.pictures.end() || !(beam.power_w > 0.0)) return std::nullopt;
  const HdrPicture& picture = shown->second;
  const auto spot = find_spot(picture, session.measured);
  if (!spot) return spot.error();
  const Relief relief = relief_of(maps, session);
  const Places places(relief, session.record);
  const auto middle = places.at(spot->x, spot->y);
  if (!middle) return invalid_argument("the beam meets the object at its outline: aim it inwards");
  const Image<float> normals = mean_normals(maps);
  const double power = session.record.find("beam")->scale * session.record.depolarised *
                       beam.power_w * entering(session.record, beam, normals, *spot, ior);
  const reconstruct::ExitLaw law(ior);
  Image<float> distances(normals.width(), normals.height(), 1);
  Image<float> units(normals.width(), normals.height(), 1);
  for (int y = 0; y < normals.height(); ++y)
    for (int x = 0; x < normals.width(); ++x) {
      const auto here = places.at(x, y);
      distances.at(x, y) = -1.0F;
      if (!here || session.measured.at(x, y) == reconstruct::kNotSeen) continue;
      distances.at(x, y) = static_cast<float>(length(*here - *middle));
      units.at(x, y) = static_cast<float>(std::numbers::pi / law.at(normals.at(x, y, 2)) / power);
    }
  BeamMeasurement measurement{spot->x, spot->y, {}};
  for (int c = 0; c < 3; ++c)
    measurement.channels[static_cast<std::size_t>(c)] = measure_channel(
        maps.channels[static_cast<std::size_t>(c)], picture, c, distances, units, ior);
  return std::optional(std::move(measurement));
}

nlohmann::ordered_json to_json(const BeamMeasurement& measurement) {
  auto channels = nlohmann::ordered_json::array();
  for (std::size_t c = 0; c < 3; ++c) {
    const BeamChannel& channel = measurement.channels[c];
    nlohmann::ordered_json json{{"channel", kChannelNames[c]},
                                {"rings", channel.distance_mm.size()}};
    if (channel.found) {
      json["translucency_mm"] = channel.found->translucency;
      json["diffusion_mm"] = channel.found->diffusion;
      json["reduced_albedo"] = channel.found->reduced_albedo;
      json["misfit"] = channel.found->misfit;
    } else {
      json["why_not"] = channel.why_not;
    }
    json["maps"] = {{"translucency_mm", channel.map_translucency},
                    {"diffusion_mm", channel.map_diffusion},
                    {"reduced_albedo", channel.map_albedo}};
    channels.push_back(std::move(json));
  }
  return {{"spot_px", {measurement.spot_x, measurement.spot_y}}, {"channels", channels}};
}

}  // namespace opaline::daemon
