#include "daemon/report/session_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <optional>
#include <span>
#include <system_error>
#include <utility>

#include "base/clock.h"
#include "base/direct_light.h"
#include "base/event_log.h"
#include "base/io/dataset_io.h"
#include "base/io/image_io.h"
#include "base/io/surface_io.h"
#include "base/io/transport_io.h"
#include "base/io/volume_io.h"
#include "calibration/record.h"
#include "daemon/jobs/version.h"
#include "daemon/report/bssrdf.h"
#include "daemon/report/found_source.h"
#include "daemon/report/picture.h"
#include "daemon/report/plot_sheet.h"
#include "daemon/report/report_data.h"
#include "daemon/report/report_page.h"
#include "daemon/report/results.h"
#include "daemon/report/step_progress.h"
#include "daemon/report/surface_view.h"
#include "daemon/session_camera.h"
#include "reconstruct/host/host_solver.h"
#include "render/renderer.h"
#include "render/translucency.h"
#include "sim/scene.h"

namespace opaline::daemon {
namespace {

using reconstruct::diffusion::FluenceSolver;

constexpr int kContactPixels = 128;
constexpr std::size_t kLightsAtATime = 8;  // a batch for the solver; between two, progress

/// Of the calibration that the session took over; none where it has none, or no chart was measured.
Result<std::optional<ShownColors>> colors_of(const SessionDirectory& session,
                                             const capture::CameraCalibration& camera) {
  std::error_code none;
  if (!std::filesystem::exists(session.calibration(), none)) return std::nullopt;
  const auto text = read_text(session.calibration());
  if (!text) return text.error();
  const auto record = calibration::record_from_text(*text, session.calibration().string());
  if (!record) return record.error();
  const auto& color = record->measured.color;
  if (!color) return std::nullopt;
  const bool is_matrix = color->model == calibration::ColorModel::kMatrix;
  return ShownColors(*color,
                     camera.sensitivity,
                     fmt::format("{} of calibration {} of {}",
                                 is_matrix ? "3 x 3 matrix" : "root polynomials",
                                 record->version,
                                 record->created));
}

/// The session's files, read.
Result<ReportData> read_session(const SessionDirectory& session) {
  auto config = config::load_resolved(session);
  if (!config) return config.error();
  const auto camera = session_camera(session, config->rig.calibration.camera.model);
  if (!camera) return camera.error();
  auto dataset = read_dataset(session.path());
  if (!dataset) return dataset.error();
  auto material = read_material(session.material());
  if (!material) return material.error();
  if (!(material->block == dataset->block)) {
    return invalid_argument("material.vdb and the dataset have different grids");
  }
  const auto text = read_text(session.reconstruction());
  if (!text) return text.error();
  auto colors = colors_of(session, config->rig.calibration.camera);
  if (!colors) return colors.error();
  ReportData data;
  data.colors = *std::move(colors);
  data.session_id = session.id();
  data.generator = fmt::format("opaline-preview {}", version());
  data.config = *std::move(config);
  data.camera = *camera;
  data.dataset = *std::move(dataset);
  data.material = *std::move(material);
  data.reconstruction = nlohmann::json::parse(*text, nullptr, false);
  if (!data.reconstruction.is_object()) {
    return invalid_argument(fmt::format("{} is not JSON", session.reconstruction().string()));
  }
  if (const auto source = found_source(data.reconstruction))
    data.config.reconstruction.source = *source;
  if (data.dataset.lit_face == data.dataset.seen_face) {
    const double margin = data.reconstruction.value("direct_light_margin_mm", 0.0);
    for (Illumination& i : data.dataset.illuminations) {
      mask_direct_light(data.dataset.block, data.dataset.lit_face, i.irradiance, margin, i.mask);
    }
  }
  return data;
}

/// As the reconstruction had it, and as it is seen from `eye`.
render::TranslucencyOptions translucency(const ReportData& data, Vec3 eye) {
  const config::SessionConfig& config = data.config;
  render::TranslucencyOptions options;
  if (reconstruct::along_rays(data.dataset, config.reconstruction)) options.eye = eye;
  options.boundary = config.reconstruction.boundary;
  options.source = {config.reconstruction.source, config.reconstruction.deposit};
  options.solve.tolerance = config.preview.tolerance;
  return options;
}

ContactPicture contact_picture(const std::string& name, const HdrPicture& hdr) {
  const int larger = std::max(hdr.radiance.width(), hdr.radiance.height());
  const int factor = std::max(1, larger / kContactPixels);
  const auto flags = hdr.saturated.samples();
  const auto saturated = static_cast<double>(std::count(flags.begin(), flags.end(), 1));
  return {name,
          reduced(hdr.radiance, factor),
          reduced_marks(hdr.saturated, factor),
          saturated / static_cast<double>(flags.size())};
}

class SessionReport {
 public:
  SessionReport(JobContext& job, ReportData data) : job_(job), data_(std::move(data)) {}
  Result<void> run(const gpu::ContextOptions& gpu);

 private:
  Result<void> light_the_material();
  Result<void> compare_all(render::Renderer& renderer);
  Result<void> compare(render::Renderer& renderer, std::size_t index);
  Result<void> look_at_surface(render::Renderer& renderer);
  Result<void> write_surface_pictures(const SurfaceView& view);
  Result<void> compare_with_transport();
  Result<void> show_object(const gpu::ContextOptions& gpu);
  Result<void> read_facts();
  Result<void> write_pictures(const RelitLight& light);
  Result<void> write_image(const std::string& name, const ImageFile& image, ImageFormat format);
  Result<void> write_report();
  StepProgress step(const char* name) { return {job_.events, clock_, name}; }

  JobContext& job_;
  const SystemClock clock_;
  ReportData data_;
  std::unique_ptr<FluenceSolver> solver_;
  std::vector<render::SurfaceField> fields_;
};

Result<void> SessionReport::run(const gpu::ContextOptions& gpu) {
  solver_ = reconstruct::host::make_host_solver({.threads = data_.config.reconstruction.threads});
  data_.solver = solver_->description();
  auto renderer = render::Renderer::create_or_host(
      {.gpu = gpu, .samples_per_axis = data_.config.preview.samples_per_axis},
      data_.config.reconstruction.threads);
  if (!renderer) return renderer.error();
  data_.renderer = (*renderer)->description();
  if (auto done = light_the_material(); !done) return done;
  if (auto done = compare_all(**renderer); !done) return done;
  if (auto done = look_at_surface(**renderer); !done) return done;
  if (auto done = compare_with_transport(); !done) return done;
  if (auto done = show_object(gpu); !done) return done;
  return write_report();
}

Result<void> SessionReport::light_the_material() {
  StepProgress progress = step("lighting");
  std::vector<render::Light> lights;
  for (const Illumination& light : data_.dataset.illuminations) {
    lights.push_back({data_.dataset.lit_face, light.irradiance});
  }
  const std::span<const render::Light> all(lights);
  while (fields_.size() < all.size()) {
    const auto batch =
        all.subspan(fields_.size(), std::min(kLightsAtATime, all.size() - fields_.size()));
    auto fields = render::illuminate(
        data_.material, batch, translucency(data_, data_.camera.centre()), *solver_, job_.stop);
    if (!fields) return fields.error().in("lighting the material");
    std::ranges::move(*fields, std::back_inserter(fields_));
    progress.done(static_cast<double>(fields_.size()) / static_cast<double>(all.size()));
  }
  return ok();
}

Result<void> SessionReport::compare_all(render::Renderer& renderer) {
  StepProgress progress = step("relighting");
  const std::vector<Illumination>& lights = data_.dataset.illuminations;
  for (std::size_t m = 0; m < lights.size(); ++m) {
    if (auto done = compare(renderer, m); !done) return done;
    progress.done(static_cast<double>(m + 1) / static_cast<double>(lights.size()),
                  {{"light", lights[m].name}});
  }
  double white = 0.0;
  for (const RelitLight& light : data_.lights) {
    white = std::max(white,
                     white_point(data_.shown(light.captured), data_.config.preview.white_quantile));
  }
  data_.white = white > 0.0 ? white : 1.0;
  double difference = 0.0;
  for (const RelitLight& light : data_.lights) {
    difference =
        std::max(difference, difference_size(light.relit, light.captured, light.counts, 0.998));
  }
  data_.difference = round_up(difference / data_.white);
  if (auto made = job_.files.make_directories(job_.session.preview()); !made) return made;
  for (const RelitLight& light : data_.lights) {
    if (auto written = write_pictures(light); !written) return written;
  }
  return ok();
}

Result<void> SessionReport::compare(render::Renderer& renderer, std::size_t index) {
  const Illumination& light = data_.dataset.illuminations[index];
  const auto hdr = read_hdr_picture(job_.session.hdr() / (light.name + ".exr"));
  if (!hdr) return hdr.error();
  data_.contacts.push_back(contact_picture(light.name, *hdr));
  data_.fits.push_back(fit_on_surface(
      data_.dataset, light, fields_[index], data_.config.reconstruction.model_error));
  if (!light.held_out) return ok();
  auto relit =
      relight(renderer, fields_[index], data_.camera, data_.dataset, light, *hdr, job_.stop);
  if (!relit) return relit.error();
  if (!relit->is_empty()) data_.lights.push_back(*std::move(relit));
  return ok();
}

Result<void> SessionReport::look_at_surface(render::Renderer& renderer) {
  if (!data_.dataset.uniform) return ok();
  const std::string& name = data_.dataset.uniform->name;
  auto surface = read_surface(job_.session.surface());
  if (!surface) return surface.error();
  auto captured = read_hdr_picture(job_.session.hdr() / (name + ".exr"));
  if (!captured) return captured.error();
  data_.contacts.push_back(contact_picture(name, *captured));
  auto view = surface_view(renderer,
                           data_,
                           *std::move(surface),
                           *std::move(captured),
                           translucency(data_, data_.camera.centre()),
                           *solver_,
                           job_.stop);
  if (!view) return view.error().in("uniform light");
  data_.surface = *std::move(view);
  return write_surface_pictures(*data_.surface);
}

Result<void> SessionReport::write_surface_pictures(const SurfaceView& view) {
  if (auto made = job_.files.make_directories(job_.session.preview()); !made) return made;
  const double white = white_point(data_.shown(view.captured), data_.config.preview.white_quantile);
  for (const auto& [kind, picture] : {std::pair{"captured", &view.captured},
                                      std::pair{"relit", &view.relit},
                                      std::pair{"material", &view.material}}) {
    const std::string name = fmt::format("{}-{}", data_.dataset.uniform->name, kind);
    const ImageFile png{tone_mapped(data_.shown(*picture), white > 0.0 ? white : 1.0), {}, {}};
    if (auto done = write_image(name + ".png", png, ImageFormat::kPng); !done) return done;
    const ImageFile exr{*picture, {}, {{"unit", "W/(mm^2 sr)"}}};
    if (auto done = write_image(name + ".exr", exr, ImageFormat::kExr); !done) return done;
  }
  return ok();
}

Result<void> SessionReport::compare_with_transport() {
  const config::SimConfig& sim = data_.config.rig.sim;
  if (!data_.config.rig.is_simulated() || sim.responses.empty()) {
    data_.bssrdf_absent = "no stored light transport of this sample";
    return ok();
  }
  const auto responses = read_transport(sim.responses);
  if (!responses) return responses.error();
  if (const auto scene = sim::scene_from_json(responses->scene); scene) {
    if (auto truth = sim::make_material(*scene); truth) data_.truth = *std::move(truth);
  }
  if (!(responses->block == data_.material.block)) {
    data_.bssrdf_absent = "the stored light transport is on another grid than the material";
    return ok();
  }
  StepProgress progress = step("BSSRDF error");
  auto errors = bssrdf_error(
      data_.material,
      *responses,
      translucency(data_, responses->camera_centre),
      *solver_,
      [&](double share) { progress.done(share); },
      job_.stop);
  if (!errors) return errors.error().in("BSSRDF error");
  data_.bssrdf = *errors;
  return ok();
}

Result<void> SessionReport::show_object(const gpu::ContextOptions& gpu) {
  if (data_.config.preview.object == "none") return ok();
  StepProgress progress = step("object");
  auto object = draw_object(job_, data_.config, gpu, [&](double share) { progress.done(share); });
  if (!object) return object.error().in("an object of the material");
  data_.object = *std::move(object);
  progress.done(1.0);
  return ok();
}

Result<void> SessionReport::write_image(const std::string& name,
                                        const ImageFile& image,
                                        ImageFormat format) {
  const auto bytes = encode_image(image, format);
  if (!bytes) return bytes.error().in(name);
  return write_whole(job_.files, job_.session.preview() / name, *bytes);
}

Result<void> SessionReport::write_pictures(const RelitLight& light) {
  const double range = data_.difference * data_.white;
  struct Output {
    const char* ending = "";
    ImageFile image;
    ImageFormat format = ImageFormat::kPng;
  };
  const std::array outputs{
      Output{"captured.png",
             {tone_mapped(data_.shown(light.captured), data_.white), {}, {}},
             ImageFormat::kPng},
      Output{"relit.png",
             {tone_mapped(data_.shown(light.relit), data_.white), {}, {}},
             ImageFormat::kPng},
      Output{"difference.png",
             {difference_picture(light.relit, light.captured, light.counts, range), {}, {}},
             ImageFormat::kPng},
      Output{"captured.exr", {light.captured, {}, {{"unit", "W/(mm^2 sr)"}}}, ImageFormat::kExr},
      Output{"relit.exr", {light.relit, {}, {{"unit", "W/(mm^2 sr)"}}}, ImageFormat::kExr}};
  for (const Output& output : outputs) {
    const std::string name = fmt::format("{}-{}", light.name, output.ending);
    if (auto written = write_image(name, output.image, output.format); !written) {
      return written;
    }
  }
  return ok();
}

Result<void> SessionReport::read_facts() {
  const auto log = read_events(job_.session.events());
  if (!log) return log.error();
  data_.facts = facts_of(log->events);
  return ok();
}

Result<void> SessionReport::write_report() {
  StepProgress progress = step("report");
  auto plots = draw_plots(
      data_, [&](double share) { progress.done(share); }, job_.stop);
  if (!plots) return plots.error().in("report");
  data_.plots = *std::move(plots);
  nlohmann::json figures = nlohmann::json::object();
  if (!data_.lights.empty()) {
    const ErrorSums relighting = data_.relighting().all();
    figures = {{"relighting_error", relighting.relative()}, {"noise_floor", relighting.floor()}};
  }
  if (data_.bssrdf) figures["bssrdf_error"] = data_.bssrdf->all().squared();
  if (auto noted = job_.events.fact("preview.completed", figures); !noted) return noted;
  if (auto read = read_facts(); !read) return read;  // up to this very moment
  if (auto written = write_whole(job_.files, job_.session.results(), results_json(data_));
      !written) {
    return written;
  }
  const auto page = report_page(data_);
  if (!page) return page.error().in("report");
  return write_whole(job_.files, job_.session.report(), *page);
}

}  // namespace

Result<void> report_session(JobContext& job, const gpu::ContextOptions& gpu) {
  auto data = read_session(job.session);
  if (!data) return data.error();
  return SessionReport(job, *std::move(data)).run(gpu);
}

}  // namespace opaline::daemon
