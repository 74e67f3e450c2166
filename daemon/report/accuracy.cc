#include "daemon/report/accuracy.h"

#include <fmt/format.h>

#include <vector>

#include "daemon/report/html.h"

namespace opaline::daemon {
namespace {

std::string percent(const nlohmann::json& rung, const char* key) {
  return fmt::format("{:.2f} %", 100.0 * rung.value(key, 0.0));
}

std::string tried(const nlohmann::json& target) {
  std::vector<std::vector<std::string>> rows;
  const std::size_t chosen = target.value("chosen", std::size_t{0});
  for (const auto& rung : target.value("rungs", nlohmann::json::array())) {
    rows.push_back({rung.value("name", "") + (rows.size() == chosen ? " (taken)" : ""),
                    percent(rung, "relighting_error"),
                    percent(rung, "noise_floor"),
                    fmt::format("{:.1f} s", rung.value("seconds", 0.0))});
  }
  return html::paragraph(target.value("message", "") + ".") +
         html::table({"settings, from cheap to dear", "relighting error", "noise floor", "time"},
                     rows);
}

}  // namespace

std::string accuracy_section(const ReportData& data) {
  const auto& c = data.config;
  const Block& block = data.dataset.block;
  std::string text =
      html::paragraph(fmt::format("Quality \"{}\"; the settings in full are at the end of this "
                                  "page. {} x {} regions captured; one cell "
                                  "of the reconstruction to {:g} of the sample's {} x {} x {} "
                                  "along each axis; solves to {:g}, at most {} "
                                  "iterations a channel.",
                                  config::to_string(c.quality),
                                  c.capture.patterns.regions,
                                  c.capture.patterns.regions,
                                  c.reduction.grid_step,
                                  block.nx,
                                  block.ny,
                                  block.nz,
                                  c.reconstruction.tolerance,
                                  c.reconstruction.max_iterations));
  const auto target = data.reconstruction.find("target_error");
  if (target != data.reconstruction.end() && target->is_object()) {
    text += tried(*target);
    text += html::paragraph(
        "Errors here are on the sample's surface cells. The held-out lights chose among these few "
        "settings, so the error "
        "of the one taken is an honest one to about the difference between neighbours.");
  }
  return html::section("accuracy", "Speed against accuracy", text);
}

}  // namespace opaline::daemon
