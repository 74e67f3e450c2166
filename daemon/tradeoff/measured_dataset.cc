#include "daemon/tradeoff/measured_dataset.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "base/files.h"
#include "base/io/dataset_io.h"
#include "base/io/transport_io.h"
#include "base/session_directory.h"
#include "config/session_config.h"
#include "daemon/report/bssrdf.h"
#include "daemon/report/found_source.h"
#include "reconstruct/back_end.h"
#include "reconstruct/host/host_solver.h"
#include "render/translucency.h"

namespace opaline::daemon {
namespace {

constexpr double kTolerance = 1e-5;  // of the solves that E is computed by

Result<void> add_session(const SessionDirectory& session, MeasuredDataset& data) {
  const auto config = config::load_resolved(session);
  if (!config) return config.error();
  data.options = config->reconstruction;
  if (const auto text = read_text(session.reconstruction())) {
    const auto source = found_source(nlohmann::json::parse(*text, nullptr, false));
    if (source) data.options.source = *source;
  }
  const config::SimConfig& sim = config->rig.sim;
  if (!config->rig.is_simulated() || sim.responses.empty()) return ok();
  auto truth = read_transport(sim.responses);
  if (truth && truth->block == data.dataset.block) data.truth = *std::move(truth);
  return ok();
}

}  // namespace

Result<MeasuredDataset> read_measured_dataset(const std::filesystem::path& directory) {
  auto dataset = read_dataset(directory);
  if (!dataset) return dataset.error().in(directory.string());
  MeasuredDataset data{*std::move(dataset), {}, {}};
  const auto held_out = std::ranges::count_if(data.dataset.illuminations,
                                              [](const Illumination& i) { return i.held_out; });
  if (held_out == 0)
    return invalid_argument(
        fmt::format("{}: no lights were kept from the fit, so nothing can be judged; capture with "
                    "held_out_lights = 4 or more",
                    directory.string()));
  if (const auto session = SessionDirectory::open(directory)) {
    if (auto added = add_session(*session, data); !added) return added.error();
  }
  return data;
}

Result<reconstruct::TradeoffSolver> solver_of(const reconstruct::TradeoffSetting& setting) {
  const reconstruct::InverseOptions& options = setting.options;
  if (options.back_end == reconstruct::BackEnd::kHost)
    return reconstruct::TradeoffSolver{reconstruct::host::make_host_solver(
        {.threads = options.threads, .precision = setting.precision})};
  auto parts = reconstruct::make_back_end(options);
  if (!parts) return parts.error();
  return reconstruct::TradeoffSolver{std::move(parts->solver), parts->engine};
}

std::function<Result<double>(const Material&, std::stop_token)> judge_of(
    const MeasuredDataset& data) {
  if (!data.truth) return {};
  return [&data](const Material& material, std::stop_token stop) -> Result<double> {
    render::TranslucencyOptions options;
    options.boundary = data.options.boundary;
    options.source = {data.options.source, data.options.deposit};
    options.solve.tolerance = kTolerance;
    if (reconstruct::along_rays(data.dataset, data.options))
      options.eye = data.truth->camera_centre;
    const auto solver = reconstruct::host::make_host_solver({.threads = data.options.threads});
    const auto errors = bssrdf_error(
        material, *data.truth, options, *solver, [](double) {}, std::move(stop));
    if (!errors) return errors.error();
    return errors->all().squared();
  };
}

}  // namespace opaline::daemon
