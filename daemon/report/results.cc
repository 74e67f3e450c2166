#include "daemon/report/results.h"

#include <algorithm>
#include <utility>

#include "config/session_config.h"

namespace opaline::daemon {
namespace {

using Json = nlohmann::ordered_json;

template <class Of>
Json per_channel(const ChannelErrors& errors, Of of) {
  Json json = Json::object();
  for (int c = 0; c < kColorChannels; ++c) json[kChannelNames[c]] = of(errors.channels[c]);
  return json;
}

double relative(const ErrorSums& sums) { return sums.relative(); }
double floor_of(const ErrorSums& sums) { return sums.floor(); }
double squared(const ErrorSums& sums) { return sums.squared(); }

Json relighting_json(const ReportData& data) {
  Json lights = Json::array();
  for (const RelitLight& light : data.lights) {
    const auto samples = light.counts.samples();
    lights.push_back({{"name", light.name},
                      {"error", light.errors.all().relative()},
                      {"noise_floor", light.errors.all().floor()},
                      {"pixels", std::count(samples.begin(), samples.end(), 1)},
                      {"per_channel", per_channel(light.errors, relative)}});
  }
  return {{"per_channel", per_channel(data.relighting(), relative)},
          {"noise_floor_per_channel", per_channel(data.relighting(), floor_of)},
          {"lights", std::move(lights)}};
}

Json fit_json(const ReportData& data) {
  Json regions = Json::array();
  for (const SurfaceFit& fit : data.fits) {
    regions.push_back({{"name", fit.name},
                       {"held_out", fit.held_out},
                       {"error", fit.errors.all().relative()},
                       {"noise_floor", fit.errors.all().floor()},
                       {"per_channel", per_channel(fit.errors, relative)},
                       {"chi_squared_per_datum", fit.chi_squared_per_datum}});
  }
  return regions;
}

Json bssrdf_json(const ReportData& data) {
  if (!data.bssrdf) return {{"absent", data.bssrdf_absent}};
  return {{"per_channel", per_channel(*data.bssrdf, squared)}};
}

Json assumptions_json(const ReportData& data) {
  Json json = Json::object();
  for (const auto& [what, value] : assumptions(data)) json[what] = value;
  return json;
}

Json capture_json(const ReportData& data) {
  Json lights = Json::array();
  for (const ContactPicture& contact : data.contacts) {
    lights.push_back({{"name", contact.name}, {"saturated_share", contact.saturated_share}});
  }
  return {{"begun", data.facts.begun},
          {"job_runs", data.facts.runs},
          {"regions_captured", data.facts.regions_captured},
          {"regions_retaken", data.facts.regions_retaken},
          {"unsteady", data.facts.unsteady},
          {"unusable", data.facts.unusable},
          {"lights", std::move(lights)}};
}

Json pictures_json(const ReportData& data) {
  if (data.lights.empty()) return {{"white", nullptr}, {"difference_scale", nullptr}};
  return {{"white", data.white}, {"difference_scale", data.difference}};
}

Json object_json(const ObjectView& object) {
  if (!object.is_drawn()) return {{"absent", object.absent}};
  return object.statistics;
}

Json surface_json(const SurfaceView& view) {
  Json json{{"median_reflectance_per_sr", view.median}};
  if (view.has_truth) json["error_against_truth"] = view.error;
  return json;
}

}  // namespace

std::string results_json(const ReportData& data) {
  const ErrorSums relighting = data.relighting().all();
  const Block& block = data.material.block;
  Json json;
  json["format"] = 1;
  json["session"] = {{"id", data.session_id},
                     {"name", data.config.name},
                     {"sample", data.config.sample_name},
                     {"station", data.config.rig.station}};
  json["cells"] = {block.nx, block.ny, block.nz};
  json["relighting_error"] = relighting.relative();
  json["relighting_noise_floor"] = relighting.floor();
  json["bssrdf_error"] = data.bssrdf ? Json(data.bssrdf->all().squared()) : Json();
  json["bssrdf_noise"] = data.bssrdf ? Json(data.bssrdf->all().squared_floor()) : Json();
  json["seconds"] = data.facts.total_seconds();
  json["seconds_per_stage"] = data.facts.stage_seconds;
  json["relighting"] = relighting_json(data);
  json["bssrdf"] = bssrdf_json(data);
  json["fit"] = fit_json(data);
  json["fit_noise_floor"] = data.fit().all().floor();
  json["capture"] = capture_json(data);
  if (data.surface) json["surface"] = surface_json(*data.surface);
  if (data.object) json["object"] = object_json(*data.object);
  json["pictures"] = pictures_json(data);
  json["reconstruction"] = data.reconstruction;
  json["assumptions"] = assumptions_json(data);
  json["settings_toml"] = config::to_toml(data.config);
  json["versions"] = {
      {"generator", data.generator}, {"solver", data.solver}, {"renderer", data.renderer}};
  return json.dump(2) + "\n";
}

}  // namespace opaline::daemon
