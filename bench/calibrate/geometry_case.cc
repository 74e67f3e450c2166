#include "bench/calibrate/geometry_case.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "base/clock.h"
#include "bench/figure.h"
#include "calibration/procedure.h"
#include "sim/board_optics.h"
#include "sim/rig.h"
#include "sim/sim_camera.h"
#include "sim/sim_projector.h"

namespace opaline::bench {
namespace {

using calibration::Record;
using calibration::RecordState;

constexpr double kBoardSquare = 13.0;
constexpr int kBoardColumns = 10;
constexpr int kBoardRows = 7;
constexpr double kBoardDistance = 350.0;
constexpr std::uint64_t kPoseSeed = 7;
constexpr double kOutOfFocus = 2.5;  // px
constexpr double kCovered = 1.0 / 3.0;

/// Remembers which poses were truly bad.
class PoseWitness : public EventSink {
 public:
  explicit PoseWitness(const sim::BoardOptics& optics) : optics_(optics) {}
  void progress(const Progress& /*p*/) override {}
  Result<void> fact(std::string_view type, const nlohmann::json& data) override {
    if (type != "pose.taken") return ok();
    const sim::SimBoardPose held = optics_.held();
    const std::string name = fmt::format("pose {}", data["pose"].get<int>());
    if (held.defocus_px > 0.0 || held.hidden > 0.0) bad.insert(name);
    fmt::print(stderr, "{}\n", data["message"].get<std::string>());
    return ok();
  }
  std::set<std::string> bad;

 private:
  const sim::BoardOptics& optics_;
};

struct GeometryCase {
  std::string name;
  sim::RigOptions rig;
  sim::BoardSceneOptions scene;
  calibration::GeometryOptions geometry;
};

// Noise and poses are the run's own.
GeometryCase geometry_case(const std::string& name, int poses, int run) {
  GeometryCase c;
  c.name = name;
  c.rig.seed = 1 + static_cast<std::uint64_t>(run);
  c.rig.camera.model = sim::board_camera(640, 480);
  c.scene.board = {.squares_x = kBoardColumns,
                   .squares_y = kBoardRows,
                   .square_mm = kBoardSquare,
                   .margin_mm = 6.0};
  c.scene.projector = sim::board_projector(c.rig.projector.width, c.rig.projector.height);
  c.scene.poses = sim::held_poses(c.scene.board,
                                  c.rig.camera.model,
                                  c.scene.projector,
                                  kBoardDistance,
                                  poses,
                                  kPoseSeed + static_cast<std::uint64_t>(run));
  c.geometry.board = {.squares_x = kBoardColumns,
                      .squares_y = kBoardRows,
                      .square_mm = kBoardSquare,
                      .known_length_mm = (kBoardColumns - 2) * kBoardSquare};
  c.geometry.poses = poses;
  return c;
}

GeometryCase with_bad_poses(GeometryCase c) {
  for (std::size_t i = 0; i < c.scene.poses.size(); i += 3) {
    if (i % 2 == 0)
      c.scene.poses[i].defocus_px = kOutOfFocus;
    else
      c.scene.poses[i].hidden = kCovered;
  }
  return c;
}

double focal_error(const CameraModel& is, const CameraModel& should) {
  return std::max(std::abs(is.fx / should.fx - 1.0), std::abs(is.fy / should.fy - 1.0));
}

double principal_error(const CameraModel& is, const CameraModel& should) {
  return std::hypot(is.cx - should.cx, is.cy - should.cy);
}

struct GeometryFigure {
  std::string name;
  double value = 0.0;
  std::string_view unit;
};

std::vector<GeometryFigure> figures_of(const GeometryCase& c,
                                       const Record& record,
                                       const PoseWitness& witness) {
  const nlohmann::json& values = record.find(calibration::kGeometryStep)->values;
  const CameraModel& camera = record.measured.camera_lens->model;
  const CameraModel& projector = record.measured.projector_lens->model;
  double good_left_out = 0.0;
  double bad_kept = 0.0;
  for (const auto& pose : values["poses"]) {
    const bool is_bad = witness.bad.contains(pose["name"].get<std::string>());
    const bool is_left_out = !pose["left_out"].get<std::string>().empty();
    good_left_out += is_left_out && !is_bad ? 1.0 : 0.0;
    bad_kept += is_bad && !is_left_out ? 1.0 : 0.0;
  }
  return {
      {"camera_rms_px", values["camera_rms_px"], "px"},
      {"projector_rms_px", values["projector_rms_px"], "px"},
      {"stereo_rms_px", values["stereo_rms_px"], "px"},
      {"length_error", std::abs(values["length_error"].get<double>()), "1"},
      {"camera_focal_error", focal_error(camera, c.rig.camera.model), "1"},
      {"projector_focal_error", focal_error(projector, c.scene.projector), "1"},
      {"camera_principal_point_error_px", principal_error(camera, c.rig.camera.model), "px"},
      {"projector_principal_point_error_px", principal_error(projector, c.scene.projector), "px"},
      {"projector_place_error_mm", length(projector.centre() - c.scene.projector.centre()), "mm"},
      {"bad_poses", static_cast<double>(witness.bad.size()), "1"},
      {"bad_poses_kept", bad_kept, "1"},
      {"good_poses_left_out", good_left_out, "1"}};
}

std::optional<std::vector<GeometryFigure>> run_geometry(const GeometryCase& c) {
  ManualClock clock;
  const auto optics =
      std::make_shared<const sim::BoardOptics>(c.rig.camera, c.rig.projector, c.scene);
  const auto rig = sim::Rig::create(c.rig, optics, &clock);
  if (!rig) {
    fmt::print(stderr, "calibration: {}: {}\n", c.name, rig.error().message);
    return std::nullopt;
  }
  sim::SimCamera camera(**rig);
  sim::SimProjector projector(**rig);
  PoseWitness witness(*optics);
  Record record;
  record.version = 1;
  const auto done = calibration::run_procedure(record,
                                               {{}, c.geometry},
                                               {},
                                               {camera, projector, clock},
                                               [](const Record&) { return ok(); },
                                               witness,
                                               {});
  if (!done || record.state() != RecordState::kAccepted) {
    fmt::print(stderr,
               "calibration: {}: {}\n",
               c.name,
               done ? calibration::refusal(record.steps.back()) : done.error().message);
    return std::nullopt;
  }
  return figures_of(c, record, witness);
}

GeometryCase with_chessboards(GeometryCase c) {
  c.geometry.projected = calibration::GeometryOptions::Projected::kChessboards;
  return c;
}

// The median of the runs, the upper one of an even number, and the worst.
bool print_runs(const std::string& name,
                int poses,
                const std::function<GeometryCase(GeometryCase)>& changed,
                int runs) {
  std::map<std::string, std::vector<double>> values;
  std::vector<GeometryFigure> figures;
  for (int run = 0; run < runs; ++run) {
    auto found = run_geometry(changed(geometry_case(name, poses, run)));
    if (!found) return false;
    figures = *std::move(found);
    for (const GeometryFigure& figure : figures) values[figure.name].push_back(figure.value);
  }
  for (const GeometryFigure& figure : figures) {
    std::vector<double>& all = values[figure.name];
    std::ranges::sort(all);
    const std::string title = fmt::format("calibration.{}", figure.name);
    print_figure(title, name, all[all.size() / 2], figure.unit);
    if (runs > 1) print_figure(title, name + "_worst", all.back(), figure.unit);
  }
  return true;
}

}  // namespace

bool print_geometry(int runs) {
  const bool sharp = print_runs("sim", 20, std::identity{}, runs);
  const bool boards = print_runs("sim_chessboard", 20, with_chessboards, runs);
  return print_runs("sim_defocused", 21, with_bad_poses, runs) && sharp && boards;
}

}  // namespace opaline::bench
