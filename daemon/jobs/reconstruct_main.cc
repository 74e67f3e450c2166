#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "base/clock.h"
#include "base/io/dataset_io.h"
#include "base/io/surface_io.h"
#include "base/io/volume_io.h"
#include "base/log.h"
#include "config/session_config.h"
#include "daemon/jobs/job.h"
#include "daemon/jobs/version.h"
#include "daemon/scattering/beam_measurement.h"
#include "daemon/scattering/sphere_maps.h"
#include "daemon/scattering/sphere_shell.h"
#include "daemon/scattering/start_material.h"
#include "reconstruct/back_end.h"
#include "reconstruct/material_uncertainty.h"
#include "reconstruct/source_choice.h"
#include "reconstruct/summary.h"
#include "reconstruct/surface_reflectance.h"
#include "reconstruct/target_error.h"

namespace opaline::daemon {
namespace {

using reconstruct::TargetReport;
using reconstruct::TargetResult;
using reconstruct::UncertaintyResult;

struct Uncertainty {
  std::optional<UncertaintyResult> found;
  std::string absent;  // why there is none
};

// One that cannot be computed costs nobody the material.
Result<Uncertainty> find_uncertainty(const config::SessionConfig& config,
                                     const Dataset& dataset,
                                     const reconstruct::InverseResult& result,
                                     const reconstruct::UncertaintyContext& context,
                                     const std::stop_token& stop) {
  if (!config.uncertainty) return Uncertainty{{}, "reconstruction.uncertainty = false"};
  auto found = reconstruct::material_uncertainty(dataset,
                                                 config.reconstruction,
                                                 result,
                                                 {.threads = config.reconstruction.threads},
                                                 context,
                                                 stop);
  if (!found && found.error().code == ErrorCode::kCancelled) return found.error();
  if (!found) {
    log::warning("uncertainty: {}", found.error().message);
    return Uncertainty{{}, "not computed: " + found.error().message};
  }
  if (!*found) return Uncertainty{{}, "every channel is homogeneous: two numbers with intervals"};
  return Uncertainty{*std::move(found), ""};
}

/// To the accuracy that is asked for, or with the settings as they are.
Result<TargetResult> find_material(const config::SessionConfig& config,
                                   const Dataset& dataset,
                                   const reconstruct::ReducedContext& context,
                                   const std::stop_token& stop) {
  if (config.target_error > 0.0)
    return reconstruct::reconstruct_to_target(
        dataset, config.target_error, config.reduction, config.reconstruction, context, stop);
  auto result = reconstruct::reconstruct_reduced(
      dataset, config.reduction, config.reconstruction, context, stop);
  if (!result) return result.error();
  return TargetResult{*std::move(result), {}};
}

nlohmann::ordered_json to_json(const TargetReport& report) {
  auto rungs = nlohmann::ordered_json::array();
  for (const reconstruct::RungReport& r : report.rungs) {
    rungs.push_back({{"name", r.name},
                     {"relighting_error", r.held_out.error},
                     {"noise_floor", r.held_out.noise_floor},
                     {"seconds", r.seconds}});
  }
  return {{"target", report.target},
          {"reached", report.reached},
          {"chosen", report.chosen},
          {"message", report.message},
          {"rungs", std::move(rungs)}};
}

nlohmann::ordered_json to_json(const reconstruct::SourceChoice& choice) {
  return {{"taken", to_string(choice.model)},
          {"surface_chi_squared_per_datum", choice.surface},
          {"collimated_chi_squared_per_datum", choice.collimated},
          {"gain", choice.gain.per_datum},
          {"gain_standard_error", choice.gain.standard_error},
          {"why", choice.why}};
}

std::string summary(const config::SessionConfig& config,
                    const Dataset& dataset,
                    const std::optional<reconstruct::SourceChoice>& source,
                    const TargetResult& found,
                    const Uncertainty& uncertainty) {
  auto json = nlohmann::ordered_json::parse(
      reconstruct::summary_json(dataset, config.reconstruction, found.result));
  json["quality"] = config::to_string(config.quality);
  json["grid_step"] = config.reduction.grid_step;
  json["use_regions"] = config.reduction.regions;
  if (source) json["source_choice"] = to_json(*source);
  if (config.target_error > 0.0) json["target_error"] = to_json(found.report);
  if (uncertainty.found) {
    json["uncertainty"] = reconstruct::to_json(*uncertainty.found);
  } else {
    json["uncertainty_absent"] = uncertainty.absent;
  }
  return json.dump(2) + "\n";
}

Result<void> reconstruct_sphere(const config::SessionConfig& config, JobContext& job) {
  const auto session = read_sphere_session(job.session, config.led_sphere);
  if (!session) return session.error();
  const auto maps =
      find_maps(*session, config.led_sphere, config.reconstruction.threads, job.events, job.stop);
  if (!maps) return maps.error();
  if (auto written = write_maps(job.files, job.session, *maps); !written) return written;
  if (auto written = write_shell(
          job.files, job.session, *maps, *session, config.led_sphere.ior, config.sample_name);
      !written) {
    if (written.error().code != ErrorCode::kInvalidArgument) return written;
    log::warning("no material.vdb: {}", written.error().message);
  }
  auto told = maps_summary(*maps, *session, config.led_sphere);
  const auto beam =
      measure_beam(*maps, *session, config.rig.light_stage.beam, config.led_sphere.ior);
  if (beam && *beam) told["beam"] = to_json(**beam);
  if (!beam) log::warning("no reference by the beam: {}", beam.error().message);
  return write_whole(job.files, job.session.reconstruction(), told.dump(2) + "\n");
}

/// Where the session has a picture under uniform light.
Result<void> write_surface_reflectance(JobContext& job,
                                       const Dataset& dataset,
                                       const Material& found,
                                       const reconstruct::InverseOptions& options,
                                       reconstruct::diffusion::FluenceSolver& solver) {
  const auto surface = reconstruct::surface_reflectance(dataset, found, options, solver, job.stop);
  if (!surface) return surface.error();
  return *surface ? write_surface(job.files, job.session.surface(), **surface) : ok();
}

/// Where the session leaves the source to the pictures; from then on it is what they asked for.
Result<std::optional<reconstruct::SourceChoice>> find_source(
    config::SessionConfig& config,
    const Dataset& dataset,
    reconstruct::diffusion::FluenceSolver& solver,
    std::stop_token stop) {
  if (!config.reconstruction.choose_source) return std::optional<reconstruct::SourceChoice>();
  auto choice = reconstruct::choose_source(dataset, config.reconstruction, solver, std::move(stop));
  if (!choice) return choice.error();
  config.reconstruction.source = choice->model;
  return std::optional(*std::move(choice));
}

Result<void> reconstruct_session(JobContext& job) {
  auto config = config::load_resolved(job.session);
  if (!config) return config.error();
  if (config->kind == config::SessionKind::kLedSphere) return reconstruct_sphere(*config, job);
  if (!config->start.empty()) {
    const auto start = read_start(config->start);
    if (!start) return start.error();
    config->reconstruction.start = *start;
  }
  const auto dataset = read_dataset(job.session.path());
  if (!dataset) return dataset.error().in("dataset");
  const auto back_end = reconstruct::make_back_end(config->reconstruction);
  if (!back_end) return back_end.error();
  const auto source = find_source(*config, *dataset, *back_end->solver, job.stop);
  if (!source) return source.error();
  const SystemClock clock;
  auto found = find_material(*config,
                             *dataset,
                             {*back_end->solver,
                              job.events,
                              clock,
                              &job.files,
                              job.session.checkpoint(),
                              back_end->engine},
                             job.stop);
  if (!found) return found.error();
  const auto uncertainty = find_uncertainty(
      *config, *dataset, found->result, {*back_end->solver, job.events, clock}, job.stop);
  if (!uncertainty) return uncertainty.error().in("uncertainty");
  found->result.material.name = config->sample_name;
  auto written = write_material(job.files,
                                job.session.material(),
                                found->result.material,
                                fmt::format("opaline-reconstruct {}", version()),
                                uncertainty->found ? &uncertainty->found->material : nullptr);
  if (!written) return written;
  auto surface = write_surface_reflectance(
      job, *dataset, found->result.material, config->reconstruction, *back_end->solver);
  if (!surface) return surface;
  return write_whole(job.files,
                     job.session.reconstruction(),
                     summary(*config, *dataset, *source, *found, *uncertainty));
}

}  // namespace
}  // namespace opaline::daemon

int main(int argc, char** argv) {
  return opaline::daemon::run_job(
      argc,
      argv,
      {"reconstruct",
       "Finds the volume of scattering coefficients that explains a session's pictures."},
      opaline::daemon::reconstruct_session);
}
