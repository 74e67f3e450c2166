#include "reconstruct/summary.h"

#include <nlohmann/json.hpp>

#include "reconstruct/direct_light.h"
#include "reconstruct/relighting_error.h"

namespace opaline::reconstruct {
namespace {

using Json = nlohmann::ordered_json;

Json to_json(const RelightingError& e) {
  return {{"relighting_error", e.error}, {"noise_floor", e.noise_floor}};
}

Json to_json(const CoefficientBounds& b) { return {b.lowest, b.highest}; }

Json to_json(const InverseOptions& o) {
  return {{"source", to_string(o.source)},
          {"deposit", to_string(o.deposit)},
          {"boundary", to_string(o.boundary)},
          {"method", to_string(o.method)},
          {"model", to_string(o.model)},
          {"structure", to_string(o.structure)},
          {"model_error", o.model_error},
          {"direct_light_paths", o.direct_light_paths},
          {"regularization", o.regularization},
          {"regularizer", to_string(o.regularizer)},
          {"coarser_grids", o.coarser_grids},
          {"grid_correction", o.grid_correction},
          {"max_iterations", o.max_iterations},
          {"tolerance", o.tolerance},
          {"discrepancy", o.discrepancy},
          {"stalled", o.stalled},
          {"absorption_bounds_per_mm", to_json(o.absorption)},
          {"reduced_scattering_bounds_per_mm", to_json(o.reduced_scattering)},
          {"back_end", to_string(o.back_end)},
          {"back_end_fallback", o.back_end_fallback},
          {"precision", to_string(o.precision)}};
}

Json history_json(const ChannelReport& report) {
  Json history = Json::array();
  for (const IterationRecord& i : report.history) {
    history.push_back({{"iteration", i.iteration},
                       {"objective", i.objective},
                       {"chi_squared_per_datum", i.chi_squared_per_datum},
                       {"regularization", i.regularization},
                       {"solves", i.solves}});
  }
  return history;
}

Json to_json(const std::optional<Interval>& i) { return i ? Json{i->lowest, i->highest} : Json(); }

Json homogeneous_json(const ChannelReport& r) {
  const HomogeneousFit& h = r.homogeneous;
  return {{"reduced_scattering", h.reduced_scattering},
          {"absorption", h.absorption},
          {"reduced_scattering_interval_95", to_json(h.reduced_scattering_interval)},
          {"absorption_interval_95", to_json(h.absorption_interval)},
          {"chi_squared_per_datum", h.chi_squared / static_cast<double>(r.data_count)},
          {"iterations", h.iterations}};
}

Json ladder_json(const ChannelReport& r) {
  Json ladder = Json::array();
  for (const ModelReport& rung : r.ladder) {
    ladder.push_back({{"model", rung.name},
                      {"parameters", rung.parameters},
                      {"fitted_chi_squared_per_datum", rung.fitted},
                      {"held_out_chi_squared_per_datum", rung.held_out},
                      {"held_out_standard_error", rung.standard_error},
                      {"gain", rung.gain},
                      {"gain_standard_error", rung.gain_error},
                      {"solves", rung.solves},
                      {"seconds", rung.seconds},
                      {"taken", rung.taken},
                      {"why", rung.why}});
  }
  return ladder;
}

Json to_json(const ChannelReport& r, const char* name) {
  return {{"channel", name},
          {"model", r.model},
          {"model_reason", r.model_reason},
          {"ladder", ladder_json(r)},
          {"held_out_noise_chi_squared_per_datum", r.held_out_noise},
          {"cross_validated", r.cross_validated},
          {"grid_correction", r.grid_correction},
          {"homogeneous", homogeneous_json(r)},
          {"stop_reason", to_string(r.stop_reason)},
          {"stop_explanation", explain(r.stop_reason)},
          {"data", r.data_count},
          {"noise_chi_squared_per_datum", r.noise_per_datum},
          {"target_chi_squared_per_datum", r.target_per_datum},
          {"solves", r.solves},
          {"seconds", r.seconds},
          {"chi_squared_per_datum", r.history.back().chi_squared_per_datum},
          {"history", history_json(r)}};
}

}  // namespace

std::string summary_json(const Dataset& dataset,
                         const InverseOptions& options,
                         const InverseResult& result) {
  Json channels = Json::array();
  for (std::size_t c = 0; c < kColorChannels; ++c)
    channels.push_back(to_json(result.channels[c], kChannelNames[c]));
  Json illuminations = Json::array();
  const Dataset masked = without_direct_light(dataset, result.direct_light_margin_mm);
  for (std::size_t m = 0; m < masked.illuminations.size(); ++m) {
    const Illumination& i = masked.illuminations[m];
    illuminations.push_back({{"name", i.name},
                             {"held_out", i.held_out},
                             {"relighting_error", relighting_error(i, result.predicted[m]).error}});
  }
  const Json summary{{"format", 1},
                     {"solver", result.solver},
                     {"seconds", result.seconds},
                     {"fitted", to_json(result.fitted)},
                     {"held_out", to_json(result.held_out)},
                     {"direct_light_margin_mm", result.direct_light_margin_mm},
                     {"options", to_json(options)},
                     {"channels", std::move(channels)},
                     {"illuminations", std::move(illuminations)}};
  return summary.dump(2) + "\n";
}

}  // namespace opaline::reconstruct
