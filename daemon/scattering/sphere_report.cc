#include "daemon/scattering/sphere_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
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
#include "daemon/scattering/dipole_view.h"
#include "daemon/scattering/sphere_maps.h"
#include "daemon/scattering/sphere_truth.h"

namespace opaline::daemon {
namespace {

using reconstruct::LeftOut;
using reconstruct::ScatteringMaps;

constexpr int kReasons = reconstruct::kLastReason + 1;
constexpr std::array<const char*, 3> kColors{"#c0392b", "#1e8449", "#2471a3"};
constexpr std::array<std::array<std::uint8_t, 3>, kReasons> kReasonColors{{{255, 255, 255},
                                                                           {40, 44, 50},
                                                                           {230, 60, 200},
                                                                           {90, 150, 230},
                                                                           {150, 90, 40},
                                                                           {120, 190, 240},
                                                                           {240, 160, 60},
                                                                           {200, 60, 60},
                                                                           {120, 200, 90},
                                                                           {220, 200, 70}}};

/// A map's values over what is shown of it.
struct View {
  const char* name;
  const char* title;  ///< with its unit
  std::vector<float> ScatteringMaps::*values;
};
constexpr std::array<View, 4> kViews{
    View{"diffusion", "Diffusion coefficient D, mm", &ScatteringMaps::diffusion},
    View{"translucency", "Translucency l_d, mm", &ScatteringMaps::translucency},
    View{"reduced_albedo", "Reduced albedo α'", &ScatteringMaps::reduced_albedo},
    View{"diffusion_log_sd", "Deviation of ln D (σ)", &ScatteringMaps::log_diffusion_deviation}};

struct Span {
  double low = 0.0;
  double high = 1.0;
};

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
  void add_picture(const std::string& name, std::string_view caption);
  void add_plot(const Result<std::string>& svg, std::string_view caption);
  void add_header(const SessionFacts& facts);
  void add_figures(const SessionFacts& facts);
  Result<void> add_dipole();
  void add_truth();
  void add_reasons();
  void add_assumptions();
  Result<void> add_histogram();
  Span span_of(const View& view) const;
  MapPlot map_plot(const View& view) const;
  nlohmann::ordered_json results(const SessionFacts& facts) const;

  JobContext& job_;
  config::SessionConfig config_;
  SphereSession session_;
  SphereMaps maps_;
  nlohmann::json reconstruction_;
  std::optional<SphereTruth> truth_;
  std::vector<std::pair<std::string, double>> dipole_errors_;
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

Image<std::uint8_t> normal_picture(const Image<float>& normals) {
  Image<std::uint8_t> picture(normals.width(), normals.height(), 3);
  for (std::size_t at = 0; at < normals.pixel_count(); ++at) {
    const float* n = &normals.samples()[3 * at];
    if (n[0] == 0.0F && n[1] == 0.0F && n[2] == 0.0F) continue;
    const std::array<float, 3> shown{n[0], -n[1], n[2]};  // y up, as such pictures are read
    for (std::size_t k = 0; k < 3; ++k)
      picture.samples()[3 * at + k] =
          static_cast<std::uint8_t>(std::lround(127.5F * (1.0F + shown[k])));
  }
  return picture;
}

Image<std::uint8_t> reason_picture(const SphereMaps& maps, const Image<std::uint8_t>& measured) {
  Image<std::uint8_t> picture(measured.width(), measured.height(), 3);
  for (std::size_t at = 0; at < measured.pixel_count(); ++at) {
    if (measured.samples()[at] == reconstruct::kNotSeen) continue;
    const auto& color = kReasonColors[static_cast<std::size_t>(maps.channels[1].left_out[at])];
    for (std::size_t k = 0; k < 3; ++k) picture.samples()[3 * at + k] = color[k];
  }
  return picture;
}

Result<void> SphereReport::write_views() {
  const double white = white_radiance(session_.record);
  for (const StagePicture& shown : session_.record.pictures) {
    if (shown.name == "constant_again") continue;
    const Image<float>& radiance = session_.pictures.at(shown.name).radiance;
    auto written =
        write_png(shown.name, tone_mapped(radiance, std::min(white, white_point(radiance, 0.998))));
    if (!written) return written;
  }
  if (auto written = write_png("normals", normal_picture(mean_normals(maps_))); !written)
    return written;
  if (maps_.specular) {
    const double bright = white_point(*maps_.specular, 0.998);
    if (auto written = write_png("specular", tone_mapped(*maps_.specular, bright)); !written)
      return written;
  }
  return write_png("left_out", reason_picture(maps_, session_.measured));
}

/// From the second to the 98th percentile of all channels.
Span SphereReport::span_of(const View& view) const {
  std::vector<float> values;
  for (const ScatteringMaps& m : maps_.channels)
    for (std::size_t at = 0; at < m.left_out.size(); ++at)
      if (m.left_out[at] == LeftOut::kFound) values.push_back((m.*view.values)[at]);
  if (values.size() < 10) return {};
  std::ranges::sort(values);
  const auto at = [&](double share) {
    return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
  };
  const double low = at(0.02);
  const double high = at(0.98);
  return {low, high > low ? high : low * 1.01 + 1e-6};
}

MapPlot SphereReport::map_plot(const View& view) const {
  constexpr int kMostAcross = 240;
  const int factor = (maps_.channels[0].width + kMostAcross - 1) / kMostAcross;
  MapPlot plot;
  plot.columns = 3;
  plot.panel_width = 240;
  plot.panel_height = 240 * maps_.channels[0].height / maps_.channels[0].width;
  plot.scale_label = view.title;
  const Span span = span_of(view);
  const double margin = 0.002 * (span.high - span.low);  // what is rounded must not fall out
  plot.lowest = span.low - margin;
  plot.highest = span.high + margin;
  const double pixel = session_.record.pixel_mm * factor;
  for (std::size_t c = 0; c < 3; ++c) {
    const ScatteringMaps& m = maps_.channels[c];
    Image<float> panel(m.width / factor, m.height / factor, 1);
    for (int y = 0; y < panel.height(); ++y)
      for (int x = 0; x < panel.width(); ++x) {
        const std::size_t at =
            static_cast<std::size_t>(y) * factor * m.width + static_cast<std::size_t>(x) * factor;
        panel.at(x, panel.height() - 1 - y) = m.left_out[at] == LeftOut::kFound
                                                  ? std::clamp((m.*view.values)[at],
                                                               static_cast<float>(span.low),
                                                               static_cast<float>(span.high))
                                                  : std::numeric_limits<float>::quiet_NaN();
      }
    plot.panels.push_back({kChannelNames[c], std::move(panel), pixel, pixel, "mm", "mm"});
  }
  return plot;
}

void SphereReport::add_picture(const std::string& name, std::string_view caption) {
  for (const auto& [known, png] : pngs_)
    if (known == name) body_ += html::picture(png, caption);
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
      "absorption and reduced scattering too.");
  double done = 0.0;
  for (const View& view : kViews) {
    const auto svg = draw(map_plot(view), view.name, job_.stop);
    if (!svg && svg.error().code == ErrorCode::kCancelled) return svg.error();
    add_plot(svg, view.title);
    progress.done(++done / (kViews.size() + 1.0));
  }
  if (auto drawn = add_histogram(); !drawn) return drawn;
  body_ += "</section>\n";
  return ok();
}

Result<void> SphereReport::add_histogram() {
  constexpr int kBins = 60;
  const Span span = span_of(kViews[0]);
  CurvePlot plot;
  plot.x_label = "D, mm";
  plot.y_label = "share of pixels, %";
  for (std::size_t c = 0; c < 3; ++c) {
    const ScatteringMaps& m = maps_.channels[c];
    Series series{std::string(kChannelNames[c]), kColors[c], {}, std::vector<double>(kBins, 0.0)};
    double count = 0.0;
    for (std::size_t at = 0; at < m.left_out.size(); ++at) {
      if (m.left_out[at] != LeftOut::kFound) continue;
      const double share = (m.diffusion[at] - span.low) / (span.high - span.low);
      count += 1.0;
      if (share >= 0.0 && share < 1.0) series.y[static_cast<std::size_t>(share * kBins)] += 100.0;
    }
    for (int bin = 0; bin < kBins; ++bin) {
      series.x.push_back(span.low + (bin + 0.5) / kBins * (span.high - span.low));
      series.y[static_cast<std::size_t>(bin)] /= std::max(1.0, count);
    }
    series.style = SeriesStyle::kSteps;
    plot.series.push_back(std::move(series));
  }
  const auto svg = draw(plot, "histogram", job_.stop);
  if (!svg && svg.error().code == ErrorCode::kCancelled) return svg.error();
  add_plot(svg, "How often each D was found. One material makes one peak; its width is the noise.");
  return ok();
}

void SphereReport::add_header(const SessionFacts& facts) {
  body_ += fmt::format(
      "<header><h1>{}</h1>\n<p>Session {}, station {}, {} lamps, begun {} UTC</p>\n<nav>",
      html::escaped(config_.sample_name),
      html::escaped(job_.session.id()),
      html::escaped(config_.rig.station),
      session_.record.lights.size(),
      html::escaped(facts.begun.substr(0, 16)));
  for (const auto& [id, title] : {std::pair{"pictures", "Pictures"},
                                  {"maps", "Maps"},
                                  {"dipole", "Rendered"},
                                  {"left-out", "Left out"},
                                  {"truth", "Truth"},
                                  {"assumptions", "Assumptions"},
                                  {"settings", "Settings"}})
    if (truth_ || std::string_view(id) != "truth")
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
    const Image<float> both = side_by_side(view, times);
    if (auto written = write_png(name, tone_mapped(both, white_point(view.captured, 0.998)));
        !written)
      return written;
    add_picture(name,
                fmt::format("{}: {:.1f} % apart (relative RMS), {:.1f} % brighter in total",
                            view.name,
                            100.0 * view.error,
                            100.0 * (view.scale - 1.0)));
    dipole_errors_.emplace_back(view.name, view.error);
  }
  body_ += "</section>\n";
  return ok();
}

void SphereReport::add_truth() {
  if (!truth_) return;
  std::vector<std::vector<std::string>> rows;
  for (const BallErrors& ball : truth_->balls)
    rows.push_back(
        {fmt::format("{:.3g} mm, {}",
                     ball.radius_mm,
                     kChannelNames[static_cast<std::size_t>(ball.channel)]),
         fmt::format("{:.4f}", ball.diffusion_mm),
         ball.found > 0 ? fmt::format("{:.4f}", ball.median_diffusion) : "–",
         ball.found > 0
             ? fmt::format("{:+.1f} %", 100.0 * (ball.median_diffusion / ball.diffusion_mm - 1.0))
             : "–",
         fmt::format("{:.4f}", ball.reduced_albedo),
         ball.found > 0 ? fmt::format("{:.4f}", ball.median_albedo) : "–",
         ball.found > 0 ? fmt::format("{:.0f} %", 100.0 * ball.within_two_sigma) : "–",
         fmt::format("{:.0f} %", 100.0 * ball.found / std::max(1, ball.seen))});
  body_ += html::section(
      "truth",
      "Against the simulated truth",
      html::paragraph(fmt::format("Medians over each ball's pixels that have an answer. Mean error "
                                  "of the normals: {:.2f}°.",
                                  truth_->mean_normal_error_deg)) +
          html::table({"ball", "D, mm", "found", "off by", "α'", "found", "within 2 σ", "answered"},
                      rows));
}

void SphereReport::add_reasons() {
  body_ += "<section id=\"left-out\">\n<h2>Left out, and why</h2>\n";
  add_picture("left_out", "Green: white has an answer, other colours as in the table.");
  static constexpr std::array<const char*, kReasons> kNames{"white",
                                                            "dark grey",
                                                            "magenta",
                                                            "blue",
                                                            "brown",
                                                            "light blue",
                                                            "orange",
                                                            "red",
                                                            "green",
                                                            "yellow"};
  std::vector<std::vector<std::string>> rows;
  for (int reason = 0; reason < kReasons; ++reason) {
    std::vector<std::string> row{fmt::format("{} ({})",
                                             reconstruct::to_string(static_cast<LeftOut>(reason)),
                                             kNames[static_cast<std::size_t>(reason)])};
    for (const ScatteringMaps& m : maps_.channels) {
      int count = 0;
      for (std::size_t at = 0; at < m.left_out.size(); ++at)
        if (session_.measured.samples()[at] != reconstruct::kNotSeen &&
            static_cast<int>(m.left_out[at]) == reason)
          ++count;
      row.push_back(fmt::format("{}", count));
    }
    rows.push_back(std::move(row));
  }
  body_ += html::table({"pixels", "red", "green", "blue"}, rows);
  body_ += "</section>\n";
}

void SphereReport::add_assumptions() {
  const config::LedSphereOptions& o = config_.led_sphere;
  body_ += html::section(
      "assumptions",
      "What was assumed",
      html::facts(
          {{"Refractive index",
            o.ior_deviation > 0.0 ? fmt::format("{} ± {}", o.ior, o.ior_deviation)
                                  : fmt::format("{}, known", o.ior)},
           {"Scattering", "isotropic (reduced coefficients), alike to some l_d around each pixel"},
           {"Shape", "as curved as a ball of its mean curvature; convex, nothing shades it"},
           {"Lamps", fmt::format("each known to {:.2g} %", 100.0 * o.lamp_deviation)},
           {"White", fmt::format("known to {:.2g} %", 100.0 * o.white_deviation)},
           {"Drift of the lamps",
            fmt::format("{:+.2f} % over the capture, evenly", 100.0 * session_.record.drift)},
           {"Estimator", "table of traced balls (reconstruct/spherical_gradient/ball_table.h)"}}));
  body_ +=
      "<section id=\"settings\">\n<h2>Settings</h2>\n<details><summary>Every setting, with the "
      "defaults filled in</summary>\n<pre>" +
      html::escaped(config::to_toml(config_)) + "</pre></details>\n</section>\n";
}

nlohmann::ordered_json SphereReport::results(const SessionFacts& facts) const {
  nlohmann::ordered_json json = reconstruction_;
  json["session"] = job_.session.id();
  json["seconds"] = facts.stage_seconds;
  json["retaken"] = facts.regions_retaken;
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
  if (auto drawn = add_dipole(); !drawn) return drawn;
  add_reasons();
  add_truth();
  add_assumptions();
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
