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

Json capture_json(const SessionFacts& facts) {
  return {{"job_runs", facts.runs},
          {"regions_captured", facts.regions_captured},
          {"regions_retaken", facts.regions_retaken},
          {"unusable", facts.unusable}};
}

}  // namespace

std::string results_json(const ReportData& data) {
  const ErrorSums relighting = data.relighting().all();
  Json json;
  json["format"] = 1;
  json["session"] = {{"id", data.session_id},
                     {"name", data.config.name},
                     {"sample", data.config.sample_name},
                     {"station", data.config.rig.station}};
  json["relighting_error"] = data.lights.empty() ? Json() : Json(relighting.relative());
  json["relighting_noise_floor"] = data.lights.empty() ? Json() : Json(relighting.floor());
  json["bssrdf_error"] = data.bssrdf ? Json(data.bssrdf->all().squared()) : Json();
  json["bssrdf_noise"] = data.bssrdf ? Json(data.bssrdf->all().squared_floor()) : Json();
  json["seconds"] = data.facts.total_seconds();
  json["seconds_per_stage"] = data.facts.stage_seconds;
  json["relighting"] = relighting_json(data);
  json["bssrdf"] = bssrdf_json(data);
  json["fit"] = fit_json(data);
  json["capture"] = capture_json(data.facts);
  json["reconstruction"] = data.reconstruction;
  json["assumptions"] = assumptions_json(data);
  json["settings_toml"] = config::to_toml(data.config);
  json["versions"] = {
      {"generator", data.generator}, {"solver", data.solver}, {"renderer", data.renderer}};
  return json.dump(2) + "\n";
}

}  // namespace opaline::daemon
