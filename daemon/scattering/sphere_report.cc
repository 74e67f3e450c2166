#include "daemon/scattering/sphere_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "base/clock.h"
#include "base/event_log.h"
#include "base/io/image_io.h"
#include "daemon/jobs/version.h"
#include "daemon/report/html.h"
#include "daemon/report/picture.h"
#include "daemon/report/plot.h"
#include "daemon/report/stage_times.h"
#include "daemon/report/step_progress.h"
#include "daemon/scattering/beam_measurement.h"
#include "daemon/scattering/dipole_view.h"
#include "daemon/scattering/sphere_maps.h"
#include "daemon/scattering/sphere_plots.h"
#include "daemon/scattering/sphere_sections.h"
#include "daemon/scattering/sphere_truth.h"
#include "daemon/scattering/turned_view.h"

namespace opaline::daemon {
namespace {

using reconstruct::LeftOut;
using reconstruct::ScatteringMaps;

class SphereReport {
 public:
  SphereReport(JobContext& job,
               config::SessionConfig config,
               SphereSession session,
               SphereMaps maps,
               nlohmann::json reconstruction)
      : job_(job),
        config_(std::move(config)),
        session_(std::move(session)),
        maps_(std::move(maps)),
        reconstruction_(std::move(reconstruction)) {
    if (config_.rig.light_stage.driver == config::StageDriver::kSim)
      truth_ = compare_with_truth(maps_, session_.measured, session_.record, config_.rig);
  }

  Result<void> run();

 private:
  Result<void> write_views();
  Result<void> write_png(const std::string& name, Image<std::uint8_t> picture);
  Result<void> add_maps();
  std::span<const std::byte> picture_of(const std::string& name) const;
  void add_picture(const std::string& name, std::string_view caption);
  void add_plot(const Result<std::string>& svg, std::string_view caption);
  void add_header(const SessionFacts& facts);
  void add_figures(const SessionFacts& facts);
  Result<void> add_dipole();
  Result<void> add_turned();
  Result<void> draw_plot(const CurvePlot& plot, const char* name, std::string_view caption);
  Result<void> add_beam();
  nlohmann::ordered_json results(const SessionFacts& facts) const;

  JobContext& job_;
  config::SessionConfig config_;
  SphereSession session_;
  SphereMaps maps_;
  nlohmann::json reconstruction_;
  std::optional<SphereTruth> truth_;
  std::vector<std::pair<std::string, double>> dipole_errors_;
  nlohmann::ordered_json scales_;  // of the maps' pictures, by name
  const SystemClock clock_;
  std::vector<std::pair<std::string, std::vector<std::byte>>> pngs_;
  std::string body_;
};

Result<void> SphereReport::write_png(const std::string& name, Image<std::uint8_t> picture) {
  auto bytes = encode_image({std::move(picture), {}, {}}, ImageFormat::kPng);
  if (!bytes) return bytes.error().in(name);
  auto written = write_whole(job_.files, job_.session.preview() / (name + ".png"), *bytes);
  pngs_.emplace_back(name, *std::move(bytes));
  return written;
}

Result<void> SphereReport::write_views() {
  const double white = white_radiance(session_.record);
  for (const StagePicture& shown : session_.record.pictures) {
    if (shown.name == "constant_again") continue;
    const Image<float>& radiance = session_.pictures.at(shown.name).radiance;
    const double bright = shown.name == "beam" ? white_point(radiance, 0.99) : white;
    auto written = write_png(shown.name,
                             tone_mapped(radiance, std::min(bright, white_point(radiance, 0.998))));
    if (!written) return written;
  }
  if (auto written = write_png("normals", normal_picture(mean_normals(maps_))); !written)
    return written;
  if (maps_.specular) {
    const double bright = white_point(*maps_.specular, 0.998);
    if (auto written = write_png("specular", tone_mapped(*maps_.specular, bright)); !written)
      return written;
  }
  for (const MapView& view : kMapViews) {
    MapPicture picture = map_picture(maps_, view);
    scales_[view.name] = {{"lowest", picture.lowest}, {"highest", picture.highest}};
    if (auto written = write_png(view.name, std::move(picture.pixels)); !written) return written;
  }
  return write_png("left_out", reason_picture(maps_, session_.measured));
}

/// Empty where none was made.
std::span<const std::byte> SphereReport::picture_of(const std::string& name) const {
  for (const auto& [known, png] : pngs_)
    if (known == name) return png;
  return {};
}

void SphereReport::add_picture(const std::string& name, std::string_view caption) {
  if (const auto png = picture_of(name); !png.empty()) body_ += html::picture(png, caption);
}

void SphereReport::add_plot(const Result<std::string>& svg, std::string_view caption) {
  body_ += svg ? html::drawing(*svg, caption)
               : html::warning(fmt::format("Not drawn: {}: {}", caption, svg.error().message));
}

Result<void> SphereReport::add_maps() {
  StepProgress progress(job_.events, clock_, "plots");
  body_ += "<section id=\"maps\">\n<h2>Scattering parameters of every pixel</h2>\n";
  body_ += html::paragraph(
      "White where a pixel has no answer; why, see below. maps.exr has every value with its unit, "
      "absorption and reduced scattering too; preview/ has these as PNG, pixel for pixel, "
      "results.json their scales.");
  double done = 0.0;
  for (const MapView& view : kMapViews) {
    const auto svg = draw(map_plot(maps_, session_.record.pixel_mm, view), view.name, job_.stop);
    if (!svg && svg.error().code == ErrorCode::kCancelled) return svg.error();
    add_plot(svg, view.title);
    progress.done(++done / (kMapViews.size() + 1.0));
  }
  if (auto drawn = draw_plot(
          diffusion_histogram(maps_),
          "histogram",
          "How often each D was found. One material makes one peak; its width is the noise.");
      !drawn)
    return drawn;
  body_ += "</section>\n";
  return ok();
}

Result<void> SphereReport::draw_plot(const CurvePlot& plot,
                                     const char* name,
                                     std::string_view caption) {
  const auto svg = draw(plot, name, job_.stop);
  if (!svg && svg.error().code == ErrorCode::kCancelled) return svg.error();
  add_plot(svg, caption);
  return ok();
}

/// The reference method beside the maps.
Result<void> SphereReport::add_beam() {
  const auto measured =
      measure_beam(maps_, session_, config_.rig.light_stage.beam, config_.led_sphere.ior);
  if (measured && !measured->has_value()) return ok();
  body_ += "<section id=\"beam\">\n<h2>A thin beam, for reference</h2>\n";
  if (!measured) {
    body_ +=
        html::warning(fmt::format("Not measured: {}", measured.error().message)) + "</section>\n";
    return ok();
  }
  const BeamMeasurement beam = measured->value_or(BeamMeasurement{});
  body_ += html::paragraph(
      "The usual way to scattering parameters: a dipole fitted to the light around a thin beam. It "
      "takes the surface for flat, so on a curved object its l_d is too long.");
  add_picture("beam", "the beam alone, its own scale");
  if (auto drawn = draw_plot(beam_plot(beam, config_.led_sphere.ior),
                             "beam_profile",
                             "Points: rings around the beam. Lines: the dipoles fitted to them.");
      !drawn)
    return drawn;
  body_ += beam_table(beam, truth_ ? &config_.rig.sim.balls : nullptr);
  body_ += "</section>\n";
  return ok();
}

void SphereReport::add_header(const SessionFacts& facts) {
  body_ += fmt::format(
      "<header><h1>{}</h1>\n<p>Session {}, station {}, {} lamps, begun {} UTC</p>\n<nav>",
      html::escaped(config_.sample_name),
      html::escaped(job_.session.id()),
      html::escaped(config_.rig.station),
      shining_lamps(session_.record),
      html::escaped(facts.begun.substr(0, 16)));
  for (const auto& [id, title] : {std::pair{"pictures", "Pictures"},
                                  {"maps", "Maps"},
                                  {"beam", "Beam"},
                                  {"dipole", "Rendered"},
                                  {"left-out", "Left out"},
                                  {"truth", "Truth"},
                                  {"assumptions", "Assumptions"},
                                  {"settings", "Settings"}})
    if ((truth_ || std::string_view(id) != "truth") &&
        (session_.pictures.contains("beam") || std::string_view(id) != "beam"))
      body_ += fmt::format("<a href=\"#{}\">{}</a>", id, title);
  body_ += "</nav></header>\n";
}

void SphereReport::add_figures(const SessionFacts& facts) {
  const auto figure = [&](const std::string& value, std::string_view meaning) {
    body_ += fmt::format("<div class=\"figure\"><b>{}</b><span>{}</span></div>\n",
                         html::escaped(value),
                         html::escaped(meaning));
  };
  body_ += "<div class=\"figures\">\n";
  const ScatteringMaps& green = maps_.channels[1];
  const auto found = std::ranges::count(green.left_out, LeftOut::kFound);
  const auto samples = session_.measured.samples();
  const auto seen = std::ssize(samples) - std::ranges::count(samples, reconstruct::kNotSeen);
  if (found > 0) {
    figure(fmt::format("{:.3g} mm", median_of(green, green.translucency)),
           "translucency l_d, green, median");
    figure(fmt::format("{:.3g} mm", median_of(green, green.diffusion)),
           "diffusion coefficient D, green, median");
    figure(fmt::format("{:.0f} %", 100.0 * median_of(green, green.log_diffusion_deviation)),
           "stated standard deviation of D, green, median");
  }
  figure(fmt::format(
             "{:.0f} %",
             100.0 * static_cast<double>(found) / std::max<double>(1.0, static_cast<double>(seen))),
         "of the object's pixels have an answer (green); the others say why not");
  if (truth_)
    figure(fmt::format("{:.2f}°", truth_->mean_normal_error_deg), "mean error of the normals");
  figure(fmt::format("{:+.2f} %", 100.0 * session_.record.drift), "drift of the lamps");
  figure(fmt::format("{:.0f} s", facts.total_seconds()), "of work, all stages");
  body_ += "</div>\n";
}

/// A view that was not captured, and the captured one by the same means.
Result<void> SphereReport::add_turned() {
  const config::LedSphereOptions& o = config_.led_sphere;
  const auto turned =
      turned_view(maps_, session_, {o.mesh, o.mesh_size_mm, o.turn_deg}, o.ior, job_.stop);
  if (!turned && turned.error().code == ErrorCode::kCancelled) return turned.error();
  if (!turned) {
    body_ +=
        html::warning(fmt::format("No other view: {}", turned.error().message)) + "</section>\n";
    return ok();
  }
  const Image<float> small = beside(turned->even, turned->from_left);
  const Image<float> both = enlarged(small, std::max(1, 640 / std::max(1, small.width())));
  if (auto written =
          write_png("dipole_turned", tone_mapped(both, white_point(turned->even, 0.998)));
      !written)
    return written;
  add_picture("dipole_turned",
              fmt::format("{}, turned by {:.4g}° and drawn by screen-space diffusion: even light; "
                          "light from the left",
                          o.mesh.empty() ? "The seen surface" : o.mesh.filename().string(),
                          o.turn_deg));
  body_ += "</section>\n";
  return ok();
}

/// What the maps make of the captured view, beside it.
Result<void> SphereReport::add_dipole() {
  const auto views = dipole_views(maps_, session_, config_.led_sphere.ior, job_.stop);
  if (!views && views.error().code == ErrorCode::kCancelled) return views.error();
  body_ += "<section id=\"dipole\">\n<h2>Rendered from the maps</h2>\n";
  if (!views) {
    body_ += html::warning(fmt::format("Not drawn: {}", views.error().message)) + "</section>\n";
    return ok();
  }
  body_ += html::paragraph(
      "On the left what the camera saw, on the right the same surface drawn from the maps: dipoles "
      "summed over it (texture-space diffusion). The maps come from transport, so what differs is "
      "what a dipole leaves out.");
  for (const DipoleView& view : *views) {
    const std::string name = "dipole_" + view.name;
    const int times = std::max(1, 320 / std::max(1, view.captured.width()));
    const Image<float> both = enlarged(beside(view.captured, view.rendered), times);
    if (auto written = write_png(name, tone_mapped(both, white_point(view.captured, 0.998)));
        !written)
      return written;
    add_picture(name,
                fmt::format("{}: {:.1f} % apart (relative RMS), {:.1f} % {} in total",
                            view.name,
                            100.0 * view.error,
                            100.0 * std::abs(view.scale - 1.0),
                            view.scale < 1.0 ? "darker" : "brighter"));
    dipole_errors_.emplace_back(view.name, view.error);
  }
  return add_turned();
}

nlohmann::ordered_json SphereReport::results(const SessionFacts& facts) const {
  nlohmann::ordered_json json = reconstruction_;
  json["session"] = job_.session.id();
  json["seconds"] = facts.stage_seconds;
  json["retaken"] = facts.regions_retaken;
  json["pictures"] = scales_;
  for (const auto& [name, error] : dipole_errors_) json["dipole_error"][name] = error;
  if (!truth_) return json;
  auto balls = nlohmann::ordered_json::array();
  for (const BallErrors& ball : truth_->balls)
    balls.push_back({{"radius_mm", ball.radius_mm},
                     {"channel", kChannelNames[static_cast<std::size_t>(ball.channel)]},
                     {"diffusion_mm", ball.diffusion_mm},
                     {"median_diffusion_mm", ball.median_diffusion},
                     {"reduced_albedo", ball.reduced_albedo},
                     {"median_reduced_albedo", ball.median_albedo},
                     {"within_two_sigma", ball.within_two_sigma},
                     {"found", ball.found},
                     {"seen", ball.seen}});
  json["truth"] = {{"normal_error_deg", truth_->mean_normal_error_deg}, {"balls", balls}};
  return json;
}

Result<void> SphereReport::run() {
  if (auto made = job_.files.make_directories(job_.session.preview()); !made) return made;
  if (auto written = write_views(); !written) return written;
  nlohmann::json noted = nlohmann::json::object();
  if (truth_) noted["normal_error_deg"] = truth_->mean_normal_error_deg;
  if (auto fact = job_.events.fact("preview.completed", noted); !fact) return fact;
  const auto log = read_events(job_.session.events());
  if (!log) return log.error();
  const SessionFacts facts = facts_of(log->events);
  add_header(facts);
  add_figures(facts);
  body_ += "<section id=\"pictures\">\n<h2>Pictures</h2>\n<div class=\"trio\">\n";
  add_picture("constant", "constant light, cross-polarised");
  add_picture("normals", "normals: red right, green up, blue towards the camera");
  add_picture("specular", "the surface's reflection: parallel less cross-polarised, its own scale");
  for (const StagePicture& shown : session_.record.pictures)
    if (shown.name.starts_with("gradient")) add_picture(shown.name, shown.name);
  body_ += "</div>\n</section>\n";
  if (auto drawn = add_maps(); !drawn) return drawn;
  if (auto drawn = add_beam(); !drawn) return drawn;
  if (auto drawn = add_dipole(); !drawn) return drawn;
  body_ += reasons_section(maps_, session_, picture_of("left_out"));
  if (truth_) body_ += truth_section(*truth_);
  body_ += assumptions_section(config_, session_);
  body_ += fmt::format("<footer>opaline-preview {}</footer>\n", version());
  if (auto written = write_whole(job_.files, job_.session.results(), results(facts).dump(2) + "\n");
      !written)
    return written;
  return write_whole(job_.files,
                     job_.session.report(),
                     html::page(fmt::format("{} - Opaline", config_.sample_name), body_));
}

}  // namespace

Result<void> report_sphere(JobContext& job) {
  auto config = config::load_resolved(job.session);
  if (!config) return config.error();
  auto session = read_sphere_session(job.session, config->led_sphere);
  if (!session) return session.error();
  auto maps = read_maps(job.session);
  if (!maps) return maps.error();
  if (maps->channels[0].left_out.size() != session->measured.pixel_count())
    return invalid_argument("maps.exr and hdr/ are of other sizes: run opaline-reconstruct again");
  const auto text = read_text(job.session.reconstruction());
  if (!text) return text.error();
  auto reconstruction = nlohmann::json::parse(*text, nullptr, false);
  if (!reconstruction.is_object())
    return invalid_argument(fmt::format("{}: damaged", job.session.reconstruction().string()));
  return SphereReport(job,
                      *std::move(config),
                      *std::move(session),
                      *std::move(maps),
                      std::move(reconstruction))
      .run();
}

}  // namespace opaline::daemon
