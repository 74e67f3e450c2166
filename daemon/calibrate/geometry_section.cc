#include "daemon/calibrate/geometry_section.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "daemon/calibrate/report_figure.h"
#include "daemon/calibrate/residual_plots.h"
#include "daemon/report/html.h"
#include "daemon/report/plot.h"

namespace opaline::daemon {
namespace {

using calibration::Measured;
using calibration::MeasuredLens;
using calibration::Record;
using calibration::StepRecord;
using TableRows = std::vector<std::vector<std::string>>;

constexpr const char* kCameraColor = "#2b5fc0";
constexpr const char* kProjectorColor = "#d08a1d";
constexpr int kFieldsX = 16;
constexpr int kFieldsY = 12;
constexpr int kBins = 41;
constexpr double kHistogramSpan = 4.0;  // deviations on either side
constexpr std::array<const char*, 9> kParameters{
    "fx, px", "fy, px", "cx, px", "cy, px", "k1", "k2", "p1", "p2", "k3"};

std::vector<CornerResidual> all_of_lens(const std::vector<PoseResiduals>& poses,
                                        std::vector<CornerResidual> PoseResiduals::*lens) {
  std::vector<CornerResidual> all;
  for (const PoseResiduals& pose : poses)
    all.insert(all.end(), (pose.*lens).begin(), (pose.*lens).end());
  return all;
}

std::array<int, 2> size_of(const calibration::DeviceIdentity& device) {
  return {device.width, device.height};
}

std::string lens_arrows(const Record& record, const std::vector<PoseResiduals>& poses) {
  const auto camera = all_of_lens(poses, &PoseResiduals::camera);
  const auto projector = all_of_lens(poses, &PoseResiduals::projector);
  const double typical = std::max(residual_rms(camera), residual_rms(projector));
  return html::drawing(
      residual_svg(
          {{fmt::format("camera, {:.3f} px", residual_rms(camera)), size_of(record.camera), camera},
           {fmt::format("projector, {:.3f} px", residual_rms(projector)),
            size_of(record.projector),
            projector}},
          {2, 430, 9.0, typical}),
      "What is left of every corner of all poses. Arrows that agree with their neighbours are a "
      "lens that the model does not fit; arrows every which way are noise.");
}

std::string pose_arrows(const Record& record, const std::vector<PoseResiduals>& poses) {
  std::vector<ResidualPanel> panels;
  panels.reserve(poses.size());
  for (const PoseResiduals& pose : poses)
    panels.push_back({fmt::format("{}: {:.3f} px", pose.name, residual_rms(pose.camera)),
                      size_of(record.camera),
                      pose.camera});
  return html::drawing(
      residual_svg(panels, {5, 170, 7.0, residual_rms(all_of_lens(poses, &PoseResiduals::camera))}),
      "The same pose by pose, in the camera's picture: a pose whose arrows all point one way "
      "moved, "
      "or its board is not flat.");
}

Series residual_bins(const std::vector<CornerResidual>& residuals,
                     double sigma,
                     const char* title,
                     const char* color) {
  Series bins{title, color, {}, {}, SeriesStyle::kSteps};
  const double width = 2.0 * kHistogramSpan * sigma / kBins;
  std::vector<double> counts(kBins, 0.0);
  for (const CornerResidual& r : residuals) {
    for (const double v : {r.dx, r.dy}) {
      const auto bin = static_cast<int>(std::floor((v + kHistogramSpan * sigma) / width));
      if (bin >= 0 && bin < kBins) counts[static_cast<std::size_t>(bin)] += 1.0;
    }
  }
  const double all = 2.0 * static_cast<double>(std::max<std::size_t>(1, residuals.size()));
  for (int b = 0; b < kBins; ++b) {
    bins.x.push_back((b + 1) * width - kHistogramSpan * sigma);  // steps end where their bin does
    bins.y.push_back(counts[static_cast<std::size_t>(b)] / all / width);
  }
  return bins;
}

Series normal_curve(double deviation, double sigma, const char* title, const char* color) {
  Series curve{title, color, {}, {}, SeriesStyle::kLine};
  for (int i = 0; i <= 200; ++i) {
    const double v = kHistogramSpan * sigma * (i / 100.0 - 1.0);
    curve.x.push_back(v);
    curve.y.push_back(std::exp(-0.5 * v * v / (deviation * deviation)) /
                      (deviation * std::sqrt(2.0 * std::numbers::pi)));
  }
  return curve;
}

std::string residual_histogram(const std::vector<PoseResiduals>& poses,
                               const std::stop_token& stop) {
  const auto camera = all_of_lens(poses, &PoseResiduals::camera);
  const auto projector = all_of_lens(poses, &PoseResiduals::projector);
  const double of_camera = residual_rms(camera) / std::numbers::sqrt2;
  const double of_projector = residual_rms(projector) / std::numbers::sqrt2;
  const double sigma = std::max(of_camera, of_projector);
  if (!(of_camera > 0.0) || !(of_projector > 0.0)) return {};
  CurvePlot plot;
  plot.x_label = "residual along x or y, px";
  plot.y_label = "share a px";
  plot.series = {residual_bins(camera, sigma, "camera", kCameraColor),
                 normal_curve(of_camera, sigma, "normal, as wide", "#9fb8e8"),
                 residual_bins(projector, sigma, "projector", kProjectorColor),
                 normal_curve(of_projector, sigma, "normal, as wide", "#ecc98a")};
  return figure(plot,
                "residual_histogram",
                "Residuals of all corners: tails above the normal curve are corners, or poses, "
                "that do not belong",
                stop);
}

MapPanel coverage_panel(const char* title,
                        const std::array<int, 2>& size,
                        const std::vector<CornerResidual>& corners) {
  Image<float> counts(kFieldsX, kFieldsY, 1);
  for (const CornerResidual& c : corners) {
    const int x = std::clamp(static_cast<int>(c.x / size[0] * kFieldsX), 0, kFieldsX - 1);
    const int y = std::clamp(static_cast<int>(c.y / size[1] * kFieldsY), 0, kFieldsY - 1);
    counts.at(x, kFieldsY - 1 - y) += 1.0F;
  }
  for (float& count : counts.samples()) {
    if (count == 0.0F) count = std::nanf("");
  }
  return {title,
          std::move(counts),
          static_cast<double>(size[0]) / kFieldsX,
          static_cast<double>(size[1]) / kFieldsY,
          "",
          ""};
}

std::string coverage_map(const Record& record,
                         const std::vector<PoseResiduals>& poses,
                         const std::stop_token& stop) {
  MapPlot plot;
  plot.panels = {
      coverage_panel("camera", size_of(record.camera), all_of_lens(poses, &PoseResiduals::camera)),
      coverage_panel(
          "projector", size_of(record.projector), all_of_lens(poses, &PoseResiduals::projector))};
  plot.columns = 2;
  plot.panel_width = 320;
  plot.panel_height = 240;
  plot.scale_label = "corners";
  plot.lowest = 0.0;
  plot.highest = 1.0;
  for (const MapPanel& panel : plot.panels) {
    for (const float count : panel.values.samples()) {
      if (std::isfinite(count)) plot.highest = std::max(plot.highest, static_cast<double>(count));
    }
  }
  return figure(
      plot,
      "coverage",
      "Where in both pictures corners were, px from the lower left; a white field had none",
      stop);
}

nlohmann::json poses_of(const StepRecord& step) {
  nlohmann::json poses = nlohmann::json::array();
  for (const auto& pose : step.values.value("poses", nlohmann::json())) {
    if (pose.is_object()) poses.push_back(pose);
  }
  return poses;
}

std::string tilt_plot(const StepRecord& step, const std::stop_token& stop) {
  Series kept{"poses", kCameraColor, {}, {}, SeriesStyle::kPoints};
  for (const auto& pose : poses_of(step)) {
    if (!pose.value("left_out", std::string()).empty() || !pose.contains("right_deg")) continue;
    kept.x.push_back(pose.value("right_deg", 0.0));
    kept.y.push_back(-pose.value("down_deg", 0.0));
    const std::string name = pose.value("name", std::string());
    kept.labels.push_back(name.starts_with("pose ") ? name.substr(5) : name);
  }
  if (kept.x.size() < 2) return {};
  CurvePlot plot;
  plot.x_label = "left edge nearer  <-  degrees  ->  right edge nearer";
  plot.y_label = "lower  <-  degrees  ->  upper";
  plot.width = 520;
  plot.height = 420;
  plot.series = {std::move(kept)};
  return figure(plot,
                "tilts",
                "How the board was tilted: a focal length is told by poses away from the "
                "middle, in all directions",
                stop);
}

std::string pose_rms_plot(const StepRecord& step,
                          const std::vector<PoseResiduals>& residuals,
                          const std::stop_token& stop) {
  BarPlot plot;
  plot.y_label = "RMS, px";
  Series camera{"camera", kCameraColor, {}, {}};
  Series projector{"projector", kProjectorColor, {}, {}};
  for (const auto& pose : poses_of(step)) {
    const std::string name = pose.value("name", "");
    const auto found = std::ranges::find(residuals, name, &PoseResiduals::name);
    const bool is_there = found != residuals.end();
    plot.groups.push_back(is_there ? name : name + ", left out");
    camera.y.push_back(is_there ? residual_rms(found->camera) : 0.0);
    projector.y.push_back(is_there ? residual_rms(found->projector) : 0.0);
  }
  if (plot.groups.empty()) return {};
  plot.series = {std::move(camera), std::move(projector)};
  return figure(plot, "pose_rms", "What is left of each pose", stop);
}

std::array<double, 9> parameters_of(const CameraModel& lens) {
  return {lens.fx,
          lens.fy,
          lens.cx,
          lens.cy,
          lens.distortion[0],
          lens.distortion[1],
          lens.distortion[2],
          lens.distortion[3],
          lens.distortion[4]};
}

void add_lens(TableRows& rows,
              const char* name,
              const std::optional<MeasuredLens>& now,
              const std::optional<MeasuredLens>& then) {
  if (!now) return;
  const auto values = parameters_of(now->model);
  for (std::size_t i = 0; i < values.size(); ++i) {
    std::vector<std::string> row{
        fmt::format("{}, {}", name, kParameters[i]),
        fmt::format("{:.6g}", values[i]),
        fmt::format(
            "{:.2g}{}", now->deviation[i], values[i] == 0.0 ? " when free; held at 0" : "")};
    if (then) {
      const double change = values[i] - parameters_of(then->model)[i];
      const double scatter = std::hypot(now->deviation[i], then->deviation[i]);
      row.push_back(fmt::format("{:+.3g}", change));
      row.push_back(scatter > 0.0 ? fmt::format("{:+.1f}", change / scatter) : "");
    }
    rows.push_back(std::move(row));
  }
}

void add_place(TableRows& rows,
               const std::optional<MeasuredLens>& now,
               const std::optional<MeasuredLens>& then) {
  if (!now) return;
  const Vec3 place = now->model.centre();
  const Vec3 old = then ? then->model.centre() : place;
  const std::array<std::pair<const char*, std::array<double, 2>>, 3> axes{
      {{"x", {place.x, old.x}}, {"y", {place.y, old.y}}, {"z", {place.z, old.z}}}};
  for (const auto& [axis, values] : axes) {
    std::vector<std::string> row{fmt::format("projector's place before the camera, {}, mm", axis),
                                 fmt::format("{:.3f}", values[0]),
                                 ""};
    if (then) row.insert(row.end(), {fmt::format("{:+.3f}", values[0] - values[1]), ""});
    rows.push_back(std::move(row));
  }
}

void add_vignetting(TableRows& rows,
                    const std::string& lens,
                    const std::optional<capture::Vignetting>& now,
                    const std::optional<capture::Vignetting>& then) {
  if (!now) return;
  std::vector<std::string> row{lens + ": light in the picture's corners over its middle",
                               fmt::format("{:.4f}", now->at(1.0)),
                               ""};
  if (then) row.insert(row.end(), {fmt::format("{:+.4f}", now->at(1.0) - then->at(1.0)), ""});
  rows.push_back(std::move(row));
}

std::string lens_table(const Record& record, const std::optional<Record>& before) {
  TableRows rows;
  const auto camera = before ? before->measured.camera_lens : std::nullopt;
  const auto projector = before ? before->measured.projector_lens : std::nullopt;
  add_lens(rows, "camera", record.measured.camera_lens, camera);
  add_lens(rows, "projector", record.measured.projector_lens, projector);
  add_place(rows, record.measured.projector_lens, projector);
  const Measured old = before ? before->measured : Measured{};
  add_vignetting(rows, "camera", record.measured.camera_vignetting, old.camera_vignetting);
  add_vignetting(rows, "projector", record.measured.projector_vignetting, old.projector_vignetting);
  std::vector<std::string> header{"lens", "now", "deviation"};
  if (camera || projector)
    header.insert(header.end(),
                  {fmt::format("since version {}", before->version), "in deviations"});
  return rows.empty() ? std::string() : html::table(header, rows);
}

std::string pose_table(const StepRecord& step) {
  TableRows rows;
  for (const auto& pose : poses_of(step)) {
    const std::string reason = pose.value("left_out", "");
    rows.push_back({pose.value("name", ""),
                    std::to_string(pose.value("corners", 0)),
                    fmt::format("{:.2f}", pose.value("blur_px", 0.0)),
                    fmt::format("{:.3f}", pose.value("rms_px", 0.0)),
                    reason.empty() ? fmt::format("{:.0f}", pose.value("distance_mm", 0.0)) : "",
                    reason.empty() ? "kept" : "left out: " + reason});
  }
  return rows.empty()
             ? std::string()
             : html::table(
                   {"pose", "corners", "blur, px", "RMS, px", "mm away", "verdict"}, rows, true);
}

}  // namespace

std::string geometry_section(const Record& record,
                             const std::optional<Record>& before,
                             std::span<const std::byte> poses_png,
                             const std::stop_token& stop) {
  const StepRecord* const step = record.find(calibration::kGeometryStep);
  if (step == nullptr) return {};
  const auto residuals = pose_residuals(step->values.value("residuals", nlohmann::json()));
  std::string body = lens_table(record, before);
  if (!residuals.empty()) {
    body += lens_arrows(record, residuals) + residual_histogram(residuals, stop) +
            coverage_map(record, residuals, stop);
  }
  body += tilt_plot(*step, stop);
  if (!residuals.empty()) {
    body += pose_rms_plot(*step, residuals, stop) + pose_arrows(record, residuals);
  }
  if (!poses_png.empty())
    body += html::picture(poses_png,
                          "The poses, corners in green; red fields had no corner up to then");
  return body + pose_table(*step);
}

}  // namespace opaline::daemon
