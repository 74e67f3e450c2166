#include "config/light_stage_config.h"

#include <fmt/format.h>

#include <algorithm>
#include <sstream>

namespace opaline::config {
namespace {

constexpr Range kAbove0 = Range{.min = 0.0, .min_excluded = true};
constexpr double kMostLamps = 2048.0;  // channels of four uDMX interfaces

void visit_lamps(Fields& fields, LightStageConfig& stage) {
  fields.whole(
      {"lamps", "of an even sphere: 156 and 346 are built ones, with a hole at the bottom"},
      stage.lamps,
      Range::between(12, kMostLamps));
  fields.length_mm({"radius", "of that sphere"}, stage.radius_mm);
  fields.number({"intensity_w_per_sr", "of each lamp at full code, towards the middle"},
                stage.intensity,
                kAbove0);
  fields.quantities({"positions_mm", "x, y, z, x, y, z, ...; y is up; none: the even sphere"},
                    stage.positions,
                    0,
                    Unit::kPlain,
                    Range::between(-1e5, 1e5));
  fields.check(stage.positions.size() % 3 == 0, "positions_mm", "expected x, y, z of every lamp");
  if (!stage.positions.empty()) stage.lamps = static_cast<int>(stage.positions.size() / 3);
  fields.check(
      stage.lamps >= 12 && stage.lamps <= kMostLamps, "positions_mm", "expected 12 to 2048 lamps");
  fields.quantities({"intensities_w_per_sr", "of each lamp, as calibrated; none: all alike"},
                    stage.intensities,
                    0,
                    Unit::kPlain,
                    kAbove0);
  fields.check(
      stage.intensities.empty() ||
          std::ssize(stage.intensities) == static_cast<std::ptrdiff_t>(stage.lamps),
      "intensities_w_per_sr",
      fmt::format(
          "{} of them; expected one for each of {} lamps", stage.intensities.size(), stage.lamps));
  fields.integers({"dead_lamps", "known ones, counted from 0; the others make up for them"},
                  stage.dead_lamps,
                  0,
                  Range::between(0, kMostLamps - 1));
  fields.check(std::ranges::all_of(stage.dead_lamps, [&](auto n) { return n < stage.lamps; }),
               "dead_lamps",
               fmt::format("expected numbers below {}", stage.lamps));
}

std::vector<std::string> words_of(const std::string& text) {
  std::istringstream stream(text);
  std::vector<std::string> words;
  for (std::string word; stream >> word;) words.push_back(word);
  return words;
}

void visit_udmx(Fields& fields, drivers::UdmxOptions& udmx) {
  fields.whole({"first_channel", "of the first lamp; 513 is the first of the second interface"},
               udmx.first_channel,
               Range::between(1, kMostLamps));
  fields.whole({"channels_per_lamp", "all of which get its code"},
               udmx.channels_per_light,
               Range::between(1, 16));
  std::string interfaces;
  for (const std::string& place : udmx.interfaces) {
    if (!interfaces.empty()) interfaces += ' ';
    interfaces += place;
  }
  fields.text({"interfaces", "USB places in order, \"3-1.2 3-1.3\"; empty: all, by place"},
              interfaces);
  udmx.interfaces = words_of(interfaces);
  fields.whole({"polarizer_channel", "of what turns the camera's polariser; 0: it stands crossed"},
               udmx.polarizer_channel,
               Range::between(0, kMostLamps));
  fields.whole({"cross_code", "on that channel"}, udmx.cross_code, Range::between(0, 255));
  fields.whole({"parallel_code", "on that channel"}, udmx.parallel_code, Range::between(0, 255));
  fields.duration({"period", "of the lamps' dimming: exposures are whole multiples"},
                  udmx.period,
                  Range::between(1e-6, 1));
  fields.duration({"latency", "from the codes to the light"}, udmx.latency, Range::between(0, 5));
}

void visit_beam(Fields& fields, BeamConfig& beam) {
  fields.number({"power_w", "of each colour channel, into the object's place; 0: there is no beam"},
                beam.power_w,
                Range::between(0, 1000));
  fields.numbers(
      {"position_mm", "where it comes from"}, beam.position_mm, Range::between(-1e5, 1e5));
  fields.numbers(
      {"aim_mm", "a place of the object that it meets"}, beam.aim_mm, Range::between(-1e5, 1e5));
  fields.check(!(beam.power_w > 0.0) || beam.position_mm != beam.aim_mm,
               "aim_mm",
               "expected another place than position_mm");
}

}  // namespace

std::vector<SphereLight> LightStageConfig::lights() const {
  std::vector<SphereLight> all;
  if (positions.empty()) {
    all = light_sphere(lamps, radius_mm, intensity);
  } else {
    for (std::size_t n = 0; n + 2 < positions.size(); n += 3)
      all.push_back({{positions[n], positions[n + 1], positions[n + 2]}, intensity});
  }
  for (std::size_t n = 0; n < std::min(all.size(), intensities.size()); ++n)
    all[n].intensity = intensities[n];
  for (const std::int64_t dead : dead_lamps)
    if (dead >= 0 && dead < std::ssize(all)) all[static_cast<std::size_t>(dead)].intensity = 0.0;
  if (has_beam())
    all.push_back({{beam.position_mm[0], beam.position_mm[1], beam.position_mm[2]}, 0.0});
  return all;
}

std::optional<sim::LedBeam> sim_beam(const LightStageConfig& stage) {
  if (!stage.has_beam()) return std::nullopt;
  const auto point = [](const std::array<double, 3>& v) { return Vec3{v[0], v[1], v[2]}; };
  return sim::LedBeam{.from = point(stage.beam.position_mm),
                      .aim = point(stage.beam.aim_mm),
                      .power_w = stage.beam.power_w};
}

void visit_light_stage(Fields& fields, LightStageConfig& stage) {
  fields.one_of({"driver", "its back end"}, stage.driver, kStageDriverNames);
  visit_lamps(fields, stage);
  fields.share({"depolarised", "depolarised light that passes the crossed polarisers"},
               stage.depolarised,
               Range{.min = 0.0, .max = 1.0, .min_excluded = true});
  fields.table({"beam", "A thin beam on the channel behind the last lamp's: the reference method."},
               [&](Fields& f) { visit_beam(f, stage.beam); });
  fields.table({"udmx", "DMX over USB."}, [&](Fields& f) { visit_udmx(f, stage.udmx); });
}

namespace {

constexpr std::array<std::string_view, 3> kMixtureNames{"none", "halves", "bands"};

void visit_body(Fields& fields, sim::LedSphereOptions& sphere) {
  fields.text({"body", "in place of the balls: ball | blob_a to blob_d | dent; of the only radius"},
              sphere.body);
  if (!sphere.body.empty()) {
    fields.check(std::ranges::find(sim::kBodyNames, sphere.body) != sim::kBodyNames.end(),
                 "body",
                 "expected ball, blob_a, blob_b, blob_c, blob_d or dent, or nothing");
    fields.check(sphere.radii_mm.size() == 1, "radii", "expected one, of the body");
  }
  fields.one_of({"mixture", "of a second material in the body"}, sphere.mixture, kMixtureNames);
  fields.numbers({"second_reduced_albedo", "red, green, blue"},
                 sphere.second_reduced_albedo,
                 Range::between(0, 0.99999));
  fields.numbers({"second_translucency", "red, green, blue"},
                 sphere.second_translucency_mm,
                 kAbove0,
                 Unit::kLength);
  fields.length_mm({"period", "of bands"}, sphere.period_mm);
  fields.length_mm({"blur", "of the step between halves"}, sphere.blur_mm);
  fields.whole({"paths_per_pixel", "of light, in a body and each channel"},
               sphere.paths_per_pixel,
               Range::between(16, 1e8));
}

}  // namespace

void visit_sim_sphere(Fields& fields, sim::LedSphereOptions& sphere, double& drift_per_hour) {
  fields.quantities(
      {"radii", "of the balls, side by side"}, sphere.radii_mm, 0, Unit::kLength, kAbove0);
  fields.check(
      !sphere.radii_mm.empty() && sphere.radii_mm.size() <= 8, "radii", "expected 1 to 8 balls");
  fields.length_mm({"gap", "between neighbours"}, sphere.gap_mm, Range::at_least(0));
  fields.numbers(
      {"reduced_albedo", "red, green, blue"}, sphere.reduced_albedo, Range::between(0, 0.99999));
  fields.numbers({"translucency", "1/sigma_tr, red, green, blue"},
                 sphere.translucency_mm,
                 kAbove0,
                 Unit::kLength);
  fields.number({"ior", "relative refractive index"}, sphere.ior, Range::between(1, 3));
  fields.number(
      {"roughness", "of the surface, GGX alpha"}, sphere.roughness, Range::between(0.02, 1));
  fields.share({"intensity_error", "standard deviation of the lamps from what is believed of them"},
               sphere.intensity_error,
               Range::between(0, 0.3));
  std::vector<std::int64_t> dead(sphere.dead_lights.begin(), sphere.dead_lights.end());
  fields.integers({"dead_lamps", "that nobody knows of, counted from 0"},
                  dead,
                  0,
                  Range::between(0, kMostLamps - 1));
  sphere.dead_lights.clear();
  for (const std::int64_t n : dead) sphere.dead_lights.push_back(static_cast<int>(n));
  fields.number(
      {"drift_per_hour", "relative, of all lamps"}, drift_per_hour, Range::between(-10, 10));
  fields.whole({"seed", "of the paths and the lamps' errors"}, sphere.seed, Range::at_least(0));
  fields.whole(
      {"paths", "of light, in each ball and channel"}, sphere.paths, Range::between(10'000, 1e10));
  visit_body(fields, sphere);
}

}  // namespace opaline::config
