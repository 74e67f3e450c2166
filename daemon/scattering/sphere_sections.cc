#include "daemon/scattering/sphere_sections.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "base/material.h"
#include "daemon/report/html.h"
#include "daemon/scattering/sphere_plots.h"

namespace opaline::daemon {

std::string beam_table(const BeamMeasurement& beam, const sim::LedSphereOptions* simulated) {
  std::vector<std::vector<std::string>> rows;
  for (std::size_t c = 0; c < 3; ++c) {
    const BeamChannel& channel = beam.channels[c];
    const auto pair = [&](double reconstruct::BeamParameters::*value, double map, double truth) {
      const std::string found =
          channel.found ? fmt::format("{:.4g}", *channel.found.*value) : std::string("–");
      return fmt::format(
          "{} / {:.4g}{}", found, map, simulated != nullptr ? fmt::format(" / {:.4g}", truth) : "");
    };
    const double albedo = simulated != nullptr ? simulated->reduced_albedo[c] : 0.0;
    const double translucency = simulated != nullptr ? simulated->translucency_mm[c] : 0.0;
    using reconstruct::BeamParameters;
    rows.push_back(
        {std::string(kChannelNames[c]),
         pair(&BeamParameters::translucency, channel.map_translucency, translucency),
         pair(&BeamParameters::diffusion,
              channel.map_diffusion,
              std::sqrt(3.0 * (1.0 - albedo)) * translucency / 3.0),
         pair(&BeamParameters::reduced_albedo, channel.map_albedo, albedo),
         channel.found ? fmt::format("{:.1f} %", 100.0 * channel.found->misfit) : channel.why_not});
  }
  const std::string of = simulated != nullptr ? "beam / maps around it / truth (first material)"
                                              : "beam / maps around it";
  return html::table({of, "l_d, mm", "D, mm", "α'", "misfit"}, rows);
}

std::string truth_section(const SphereTruth& truth) {
  std::vector<std::vector<std::string>> rows;
  for (const BallErrors& ball : truth.balls)
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
  return html::section(
      "truth",
      "Against the simulated truth",
      html::paragraph(fmt::format("Medians over each ball's pixels that have an answer. Mean error "
                                  "of the normals: {:.2f}°.",
                                  truth.mean_normal_error_deg)) +
          html::table({"ball", "D, mm", "found", "off by", "α'", "found", "within 2 σ", "answered"},
                      rows));
}

std::string reasons_section(const SphereMaps& maps,
                            const SphereSession& session,
                            std::span<const std::byte> png) {
  std::string body = "<section id=\"left-out\">\n<h2>Left out, and why</h2>\n";
  if (!png.empty())
    body += html::picture(png, "Green: white has an answer, other colours as in the table.");
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
    std::vector<std::string> row{
        fmt::format("{} ({})",
                    reconstruct::to_string(static_cast<reconstruct::LeftOut>(reason)),
                    kNames[static_cast<std::size_t>(reason)])};
    for (const reconstruct::ScatteringMaps& m : maps.channels) {
      int count = 0;
      for (std::size_t at = 0; at < m.left_out.size(); ++at)
        if (session.measured.samples()[at] != reconstruct::kNotSeen &&
            static_cast<int>(m.left_out[at]) == reason)
          ++count;
      row.push_back(fmt::format("{}", count));
    }
    rows.push_back(std::move(row));
  }
  body += html::table({"pixels", "red", "green", "blue"}, rows);
  body += "</section>\n";
  return body;
}

std::string assumptions_section(const config::SessionConfig& config, const SphereSession& session) {
  const config::LedSphereOptions& o = config.led_sphere;
  std::string body = html::section(
      "assumptions",
      "What was assumed",
      html::facts(
          {{"Refractive index",
            o.ior_deviation > 0.0 ? fmt::format("{} ± {}", o.ior, o.ior_deviation)
                                  : fmt::format("{}, known", o.ior)},
           {"Scattering", "isotropic (reduced coefficients), alike to some l_d around each pixel"},
           {"Shape",
            "bends alike to some l_d around each pixel, by two curvatures; nothing shades it"},
           {"Lamps", fmt::format("each known to {:.2g} %", 100.0 * o.lamp_deviation)},
           {"White", fmt::format("known to {:.2g} %", 100.0 * o.white_deviation)},
           {"Drift of the lamps",
            fmt::format("{:+.2f} % over the capture, evenly", 100.0 * session.record.drift)},
           {"Estimator", "table of traced balls (reconstruct/spherical_gradient/ball_table.h)"}}));
  body +=
      "<section id=\"settings\">\n<h2>Settings</h2>\n<details><summary>Every setting, with the "
      "defaults filled in</summary>\n<pre>" +
      html::escaped(config::to_toml(config)) + "</pre></details>\n</section>\n";
  return body;
}

}  // namespace opaline::daemon
