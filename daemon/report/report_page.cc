#include "daemon/report/report_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/io/image_io.h"
#include "daemon/report/html.h"
#include "daemon/report/picture.h"
#include "daemon/report/plot.h"
#include "daemon/report/report_plots.h"

namespace opaline::daemon {
namespace {

using Rows = std::vector<std::vector<std::string>>;

std::string percent(double share) { return fmt::format("{:.2f} %", 100.0 * share); }

std::string seconds_text(double seconds) {
  if (seconds < 100.0) return fmt::format("{:.1f} s", seconds);
  return fmt::format(
      "{} min {:02d} s", static_cast<int>(seconds) / 60, static_cast<int>(seconds) % 60);
}

/// Appends what can fail to a page; after the first failure nothing more is added.
class Page {
 public:
  explicit Page(std::stop_token stop) : stop_(std::move(stop)) {}

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
  template <class Plot>
  void add_plot(const Plot& plot, std::string_view caption) {
    if (error_) return;
    const auto svg = draw(plot, fmt::format("plot{}", ++plots_), stop_);
    if (!svg) {
      error_ = svg.error().in(caption);
    } else {
      body_ += html::drawing(*svg, caption);
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
  std::stop_token stop_;
  std::string body_;
  int plots_ = 0;
  std::optional<Error> error_;
};

void add_trio(const RelitLight& light, const ReportData& data, Page& page) {
  const ErrorSums sums = light.errors.all();
  page.add("<div class=\"trio\">\n");
  page.add_picture(tone_mapped(light.captured, data.white), light.name + ", captured");
  page.add_picture(tone_mapped(light.relit, data.white), "relit");
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
  page.add(
      key_figure(percent(sums.relative()),
                 fmt::format("relighting error under {} lights kept from the fit; noise alone: {}",
                             data.lights.size(),
                             percent(sums.floor()))));
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
  page.add(fmt::format("<header><h1>{}</h1>\n<p>Session {}, station {}</p>\n<nav>",
                       html::escaped(data.config.sample_name),
                       html::escaped(data.session_id),
                       html::escaped(data.config.rig.station)));
  for (const auto& [id, title] : {std::pair{"relighting", "Relighting"},
                                  {"capture", "Capture"},
                                  {"fit", "Fit"},
                                  {"convergence", "Convergence"},
                                  {"material", "Material"},
                                  {"assumptions", "Assumptions"},
                                  {"timings", "Timings"},
                                  {"settings", "Settings"}}) {
    page.add(fmt::format("<a href=\"#{}\">{}</a>", id, title));
  }
  page.add("</nav></header>\n");
}

/// The light that shows most of the sample stands for all on top.
const RelitLight& showpiece(const ReportData& data) {
  return *std::max_element(
      data.lights.begin(), data.lights.end(), [](const RelitLight& a, const RelitLight& b) {
        return a.errors.all().signal < b.errors.all().signal;
      });
}

void add_relighting(const ReportData& data, Page& page) {
  page.begin("relighting", "Relit under lights it has not seen");
  page.add(
      html::paragraph(fmt::format("Each light was captured but kept from the fit. All captured and "
                                  "relit pictures share one scale: "
                                  "white is {:.3g} W/(mm² sr). Differences are means over the "
                                  "channels; grey pixels do not count: "
                                  "background, the lens-blurred outline, saturated or masked ones.",
                                  data.white)));
  page.add_plot(
      ScalePlot{
          "relit minus captured, % of white", -100.0 * data.difference, 100.0 * data.difference},
      "Scale of the difference pictures");
  for (const RelitLight& light : data.lights) add_trio(light, data, page);
  Rows rows;
  for (const RelitLight& light : data.lights) {
    std::vector<std::string> row{
        light.name, percent(light.errors.all().relative()), percent(light.errors.all().floor())};
    for (const ErrorSums& channel : light.errors.channels)
      row.push_back(percent(channel.relative()));
    rows.push_back(std::move(row));
  }
  page.add(html::table({"light", "error", "noise floor", "red", "green", "blue"}, rows));
  page.end();
}

void add_capture(const ReportData& data, Page& page) {
  page.begin("capture", "Captured HDR pictures");
  page.add(html::paragraph(fmt::format(
      "{} lights, each picture to its own scale; pixels saturated even in the shortest exposure "
      "are magenta. Lights taken again after a bad frame: {}.",
      data.contacts.size(),
      data.facts.regions_retaken)));
  for (const std::string& why : data.facts.unusable) {
    page.add(fmt::format("<p class=\"warn\">Not usable: {}</p>\n", html::escaped(why)));
  }
  page.add("<div class=\"sheet\">\n");
  for (const ContactPicture& contact : data.contacts) {
    auto picture = tone_mapped(contact.radiance, white_point(contact.radiance, 0.998));
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

void add_fit(const ReportData& data, Page& page) {
  page.begin("fit", "How well the pictures are explained");
  page.add_plot(fit_plot(data), "Relative error on the sample's surface, light by light");
  page.add_plot(residual_plot(data, false), "Residuals of the lights that were fitted");
  page.add_plot(residual_plot(data, true), "Residuals of the lights that were not");
  page.end();
}

void add_convergence(const ReportData& data, Page& page) {
  page.begin("convergence", "Convergence");
  page.add_plot(convergence_plot(data), "Misfit over measured variance and model error");
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
      {"channel", "iterations", "χ² per datum", "data", "solves", "time", "ended because"}, rows));
  page.end();
}

void add_material(const ReportData& data, Page& page) {
  page.begin("material", "The material");
  page.add(
      html::paragraph("Cuts from the lit side (left) to the camera's, and one across the middle. "
                      "The volume itself is "
                      "material.vdb, in the session's directory."));
  for (const auto& [coefficient, name] :
       {std::pair{Coefficient::kAbsorption, "Absorption σa"},
        {Coefficient::kReducedScattering, "Reduced scattering σs'"},
        {Coefficient::kDiffusion, "Diffusion coefficient κ = 1 / (3 (σa + σs'))"}}) {
    page.add(fmt::format("<h3>{}</h3>\n", name));
    for (int c = 0; c < kColorChannels; ++c) {
      page.add_plot(slices_plot(data, coefficient, c),
                    fmt::format("{}, {}", name, kChannelNames[c]));
    }
  }
  page.end();
}

void add_timings(const ReportData& data, Page& page) {
  Rows rows;
  for (const auto& [stage, seconds] : data.facts.stage_seconds) {
    rows.push_back({stage, seconds_text(seconds)});
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

Result<std::string> report_page(const ReportData& data, std::stop_token stop) {
  if (data.lights.empty()) {
    return invalid_argument("no held-out light was captured, so there is nothing to show");
  }
  Page page(std::move(stop));
  add_header(data, page);
  add_key_figures(data, page);
  add_trio(showpiece(data), data, page);
  add_relighting(data, page);
  add_capture(data, page);
  add_fit(data, page);
  add_convergence(data, page);
  add_material(data, page);
  page.add(html::section("assumptions", "What was assumed", html::facts(assumptions(data))));
  add_timings(data, page);
  add_settings(data, page);
  page.add(fmt::format("<footer>{}</footer>\n", html::escaped(data.generator)));
  auto body = page.take();
  if (!body) return body.error();
  return html::page(fmt::format("{} - Opaline", data.config.sample_name), *body);
}

}  // namespace opaline::daemon
