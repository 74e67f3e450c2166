#include "daemon/report/report_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/io/image_io.h"
#include "daemon/report/accuracy.h"
#include "daemon/report/html.h"
#include "daemon/report/model_section.h"
#include "daemon/report/picture.h"
#include "daemon/report/report_plots.h"
#include "daemon/report/uncertainty_section.h"

namespace opaline::daemon {
namespace {

using Rows = std::vector<std::vector<std::string>>;

std::string percent(double share) {
  return std::isfinite(share) ? fmt::format("{:.2f} %", 100.0 * share) : "–";
}

std::string seconds_text(double seconds) {
  if (seconds < 100.0) return fmt::format("{:.1f} s", seconds);
  return fmt::format(
      "{} min {:02d} s", static_cast<int>(seconds) / 60, static_cast<int>(seconds) % 60);
}

/// Appends what can fail to a page; after the first failure no more pictures are added.
class Page {
 public:
  void add(std::string_view html) { body_ += html; }
  void add_picture(Image<std::uint8_t> picture, std::string_view caption) {
    if (error_) return;
    const auto png = encode_image({std::move(picture), {}, {}}, ImageFormat::kPng);
    if (!png) {
      error_ = png.error();
    } else {
      body_ += html::picture(*png, caption);
    }
  }
  void add_plots(const ReportData& data, std::string_view place) {
    for (const DrawnPlot& plot : data.plots) {
      if (plot.place != place) continue;
      add(plot.svg.empty() ? html::warning("Not drawn: " + plot.caption)
                           : html::drawing(plot.svg, plot.caption));
    }
  }
  void begin(std::string_view id, std::string_view title) {
    add(fmt::format("<section id=\"{}\">\n<h2>{}</h2>\n", id, html::escaped(title)));
  }
  void end() { add("</section>\n"); }
  Result<std::string> take() {
    if (error_) return *error_;
    return std::move(body_);
  }

 private:
  std::string body_;
  std::optional<Error> error_;
};

void add_trio(const RelitLight& light, const ReportData& data, Page& page) {
  const ErrorSums sums = light.errors.all();
  page.add("<div class=\"trio\">\n");
  page.add_picture(tone_mapped(data.shown(light.captured), data.white), light.name + ", captured");
  page.add_picture(tone_mapped(data.shown(light.relit), data.white), "relit");
  page.add_picture(
      difference_picture(light.relit, light.captured, light.counts, data.difference * data.white),
      fmt::format(
          "difference; error {}, noise {}", percent(sums.relative()), percent(sums.floor())));
  page.add("</div>\n");
}

std::string key_figure(const std::string& value, std::string_view meaning) {
  return fmt::format("<div class=\"figure\"><b>{}</b><span>{}</span></div>\n",
                     html::escaped(value),
                     html::escaped(meaning));
}

void add_key_figures(const ReportData& data, Page& page) {
  const ErrorSums sums = data.relighting().all();
  page.add("<div class=\"figures\">\n");
  if (!data.lights.empty()) {
    page.add(key_figure(
        percent(sums.relative()),
        fmt::format("relighting error under {} lights kept from the fit; noise alone: {}",
                    data.lights.size(),
                    percent(sums.floor()))));
  }
  if (data.bssrdf) {
    const ErrorSums e = data.bssrdf->all();
    page.add(
        key_figure(fmt::format("{:.4f}", e.squared()),
                   fmt::format("BSSRDF error E against stored light transport; its noise: {:.4f}",
                               e.squared_floor())));
  }
  page.add(key_figure(seconds_text(data.facts.total_seconds()),
                      "of work: capture, reconstruction and this report"));
  const Block& block = data.material.block;
  page.add(key_figure(fmt::format("{}×{}×{}", block.nx, block.ny, block.nz),
                      "cells, absorption and scattering in each, per colour channel"));
  page.add("</div>\n");
}

void add_header(const ReportData& data, Page& page) {
  const std::string& begun = data.facts.begun;  // 2026-01-31T12:34:56.789Z
  page.add(fmt::format("<header><h1>{}</h1>\n<p>Session {}, station {}, begun {} {} UTC</p>\n<nav>",
                       html::escaped(data.config.sample_name),
                       html::escaped(data.session_id),
                       html::escaped(data.config.rig.station),
                       html::escaped(begun.substr(0, 10)),
                       html::escaped(begun.size() > 16 ? begun.substr(11, 5) : "")));
  for (const auto& [id, title] : {std::pair{"relighting", "Relighting"},
                                  {"capture", "Capture"},
                                  {"fit", "Fit"},
                                  {"model", "Model"},
                                  {"convergence", "Convergence"},
                                  {"accuracy", "Accuracy"},
                                  {"material", "Material"},
                                  {"uncertainty", "Uncertainty"},
                                  {"assumptions", "Assumptions"},
                                  {"timings", "Timings"},
                                  {"settings", "Settings"}}) {
    page.add(fmt::format("<a href=\"#{}\">{}</a>", id, title));
    if (data.surface && std::string_view(id) == "capture")
      page.add("<a href=\"#surface\">Surface</a>");
    if (data.object && std::string_view(id) == "material")
      page.add("<a href=\"#object\">Object</a>");
  }
  page.add("</nav></header>\n");
}

void add_missing_plots(const ReportData& data, Page& page) {
  const auto is_missing = [](const DrawnPlot& plot) { return plot.svg.empty(); };
  const auto first = std::ranges::find_if(data.plots, is_missing);
  if (first == data.plots.end()) return;
  page.add(html::warning(fmt::format("{} of {} plots could not be drawn: {}",
                                     std::ranges::count_if(data.plots, is_missing),
                                     data.plots.size(),
                                     first->absent)));
}

/// The light that shows most of the sample stands for all on top.
const RelitLight& showpiece(const ReportData& data) {
  return *std::max_element(
      data.lights.begin(), data.lights.end(), [](const RelitLight& a, const RelitLight& b) {
        return a.errors.all().signal < b.errors.all().signal;
      });
}

std::vector<std::string> error_row(const std::string& name, const ChannelErrors& errors) {
  std::vector<std::string> row{
      name, percent(errors.all().relative()), percent(errors.all().floor())};
  for (const ErrorSums& channel : errors.channels) row.push_back(percent(channel.relative()));
  return row;
}

void add_relighting(const ReportData& data, Page& page) {
  page.begin("relighting", "Relit under lights it has not seen");
  if (data.lights.empty()) {
    page.add(html::warning(
        "How well the material predicts new light is not known: no light was kept from the fit, or "
        "none of those could be used. Set capture.held_out_lights to 4 or more to measure it."));
    return page.end();
  }
  page.add(html::paragraph(
      fmt::format("Each light was captured but kept from the fit. All captured and relit pictures "
                  "share one scale: white is {:.3g} W/(mm² sr). Relit pictures show the sample's "
                  "sides as well. Differences are means over the channels; grey pixels do not "
                  "count: background, the lens-blurred outline, saturated or masked ones.",
                  data.white)));
  page.add_plots(data, "relighting");
  for (const RelitLight& light : data.lights) add_trio(light, data, page);
  Rows rows;
  for (const RelitLight& light : data.lights) rows.push_back(error_row(light.name, light.errors));
  rows.push_back(error_row("all together", data.relighting()));
  page.add(html::paragraph(
      "The error is ‖L − L*‖ / ‖L*‖ over the pixels that count, L relit and L* captured; the noise "
      "floor is what the camera's noise alone would give."));
  page.add(html::table({"light", "error", "noise floor", "error, red", "green", "blue"}, rows));
  page.end();
}

void add_capture(const ReportData& data, Page& page) {
  page.begin("capture", "Captured HDR pictures");
  page.add(html::paragraph(fmt::format(
      "{} lights, each picture to its own scale; pixels saturated even in the shortest exposure "
      "are magenta. Lights taken again after a bad frame: {}. Takes whose exposures did not agree "
      "with each other, none of them used: {}.",
      data.contacts.size(),
      data.facts.regions_retaken,
      data.facts.unsteady.size())));
  for (const std::string& what : data.facts.unsteady)
    page.add(html::warning("Not steady: " + what));
  for (const std::string& why : data.facts.unusable) {
    page.add(html::warning("Not usable: " + why));
  }
  page.add("<div class=\"sheet\">\n");
  for (const ContactPicture& contact : data.contacts) {
    const Image<float> shown = data.shown(contact.radiance);
    auto picture = tone_mapped(shown, white_point(shown, 0.998));
    mark(picture, contact.saturated);
    const std::string saturated =
        contact.saturated_share > 0.0
            ? fmt::format(", {} saturated", percent(contact.saturated_share))
            : "";
    page.add_picture(std::move(picture), contact.name + saturated);
  }
  page.add("</div>\n");
  page.end();
}

std::string triple(const std::array<double, 3>& values, std::string_view unit, double scale) {
  return fmt::format(
      "{:.3g}, {:.3g}, {:.3g} {}", scale * values[0], scale * values[1], scale * values[2], unit);
}

void add_surface(const ReportData& data, const SurfaceView& view, Page& page) {
  page.begin("surface", "What the surface reflects by itself");
  page.add(
      html::paragraph("The whole face lit at once: what the camera saw, what the material explains "
                      "with light that was in it, and both "
                      "with the surface's own reflection, ρₛ = (L − L_material) / E. It holds for "
                      "this direction of light and view; "
                      "surface_reflectance.exr has it."));
  const double white = white_point(data.shown(view.captured), 0.998);
  page.add("<div class=\"trio\">\n");
  page.add_picture(tone_mapped(data.shown(view.captured), white), "captured");
  page.add_picture(tone_mapped(data.shown(view.material), white), "the material alone");
  page.add_picture(tone_mapped(data.shown(view.relit), white), "with its surface");
  page.add("</div>\n");
  const Image<float>& rho = view.surface.reflectance;
  const double brightest = white_point(rho, 0.998);
  page.add_picture(
      tone_mapped(rho, brightest > 0.0 ? brightest : 1.0),
      fmt::format(
          "ρₛ on the cells of {}; white is {:.3g} /sr", to_string(view.surface.face), brightest));
  std::vector<std::pair<std::string, std::string>> facts{
      {"Median ρₛ: red, green, blue", triple(view.median, "/sr", 1.0)}};
  if (view.has_truth)
    facts.emplace_back("Against the simulated sample's: red, green, blue",
                       triple(view.error, "% off", 100.0));
  page.add(html::facts(facts));
  page.end();
}

void add_fit(const ReportData& data, Page& page) {
  page.begin("fit", "How well the pictures are explained");
  page.add_plots(data, "fit");
  page.end();
}

void add_model(const ReportData& data, Page& page) {
  const std::string told = model_section(data.reconstruction);
  page.begin("model", "How much model the sample needed");
  page.add(told.empty() ? html::warning("The reconstruction does not tell which models it tried.")
                        : told);
  page.add_plots(data, "model");
  page.end();
}

void add_convergence(const ReportData& data, Page& page) {
  page.begin("convergence", "Convergence");
  page.add_plots(data, "convergence");
  Rows rows;
  const nlohmann::json none = nlohmann::json::array();
  for (const auto& channel : data.reconstruction.value("channels", none)) {
    rows.push_back(
        {channel.value("channel", ""),
         fmt::format("{}", std::max<std::size_t>(channel.value("history", none).size(), 1) - 1),
         fmt::format("{:.4g}", channel.value("chi_squared_per_datum", 0.0)),
         fmt::format("{}", channel.value("data", 0L)),
         fmt::format("{}", channel.value("solves", 0L)),
         seconds_text(channel.value("seconds", 0.0)),
         channel.value("stop_explanation", channel.value("stop_reason", ""))});
  }
  page.add(html::table(
      {"channel", "iterations", "χ² per datum", "data", "solves", "time", "ended because"},
      rows,
      true));
  page.end();
}

void add_material(const ReportData& data, Page& page) {
  page.begin("material", "The material");
  page.add(
      html::paragraph("Cuts from the lit side (left) to the camera's, and one across the middle. "
                      "The volume itself is "
                      "material.vdb, in the session's directory. What the pictures do not "
                      "determine stays near the homogeneous fit."));
  for (const Coefficient coefficient : kCoefficients) {
    page.add(fmt::format("<h3>{}</h3>\n", html::escaped(title_of(coefficient))));
    page.add_plots(data, place_of(coefficient));
  }
  page.end();
}

void add_object(const ObjectView& object, Page& page) {
  page.begin("object", "An object made of it");
  if (!object.is_drawn()) {
    page.add(html::warning("Not drawn: " + object.absent));
    return page.end();
  }
  page.add(html::paragraph(
      "The shape is cut from the middle of the material, mirrored beyond it, and lit "
      "from behind and from above. preview/object.toml is its scene: \"opaline view\" opens it to "
      "be lit, "
      "painted into and bent."));
  page.add_picture(object.picture, "drawn by " + object.drawn_by);
  Rows rows;
  for (const auto& part : object.statistics["objects"]) {
    if (part.value("kind", "") != "translucent") continue;
    rows.push_back({part.value("name", ""),
                    fmt::format("{}", part.value("tetrahedra", 0L)),
                    fmt::format("{:.3g} mm", part.value("spacing_mm", 0.0)),
                    fmt::format("{}", part.value("iterations", 0L)),
                    fmt::format("{:.1e}", part.value("relative_residual", 0.0))});
  }
  page.add(html::table({"object", "tetrahedra", "smallest edge", "iterations", "residual"}, rows));
  for (const auto& note : object.statistics["notes"])
    page.add(html::paragraph(note.get<std::string>()));
  page.end();
}

void add_uncertainty(const ReportData& data, Page& page) {
  page.begin("uncertainty", "How well the material is known");
  page.add(uncertainty_section(data.reconstruction));
  page.add_plots(data, "uncertainty");
  page.end();
}

void add_timings(const ReportData& data, Page& page) {
  Rows rows;
  for (const char* stage : {"capture", "reconstruct", "preview"}) {
    const auto found = data.facts.stage_seconds.find(stage);
    if (found != data.facts.stage_seconds.end())
      rows.push_back({stage, seconds_text(found->second)});
  }
  rows.push_back({"total", seconds_text(data.facts.total_seconds())});
  page.begin("timings", "Timings");
  page.add(html::table({"stage", "time"}, rows));
  page.add(html::facts({{"Solver", data.solver},
                        {"Renderer", data.renderer},
                        {"Job runs", fmt::format("{}", data.facts.runs)}}));
  page.end();
}

void add_settings(const ReportData& data, Page& page) {
  page.begin("settings", "Settings");
  page.add("<details><summary>Every setting, with the defaults filled in</summary>\n<pre>" +
           html::escaped(config::to_toml(data.config)) + "</pre></details>\n");
  page.end();
}

}  // namespace

Result<std::string> report_page(const ReportData& data) {
  Page page;
  add_header(data, page);
  add_missing_plots(data, page);
  add_key_figures(data, page);
  if (!data.lights.empty()) add_trio(showpiece(data), data, page);
  add_relighting(data, page);
  add_capture(data, page);
  if (data.surface) add_surface(data, *data.surface, page);
  add_fit(data, page);
  add_model(data, page);
  add_convergence(data, page);
  page.add(accuracy_section(data));
  add_material(data, page);
  if (data.object) add_object(*data.object, page);
  add_uncertainty(data, page);
  page.add(html::section("assumptions", "What was assumed", html::facts(assumptions(data))));
  add_timings(data, page);
  add_settings(data, page);
  page.add(fmt::format("<footer>{}</footer>\n", html::escaped(data.generator)));
  auto body = page.take();
  if (!body) return body.error();
  return html::page(fmt::format("{} - Opaline", data.config.sample_name), *body);
}

}  // namespace opaline::daemon
