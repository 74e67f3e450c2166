#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <vector>

#include "calibration/board_finder.h"
#include "calibration/pair_fit.h"
#include "calibration/posing.h"
#include "calibration/residuals.h"
#include "calibration/step.h"
#include "calibration/vignetting_fit.h"

namespace opaline::calibration {
namespace {

constexpr double kLensRms = 0.30;    // px; the gates are those for a real station
constexpr double kStereoRms = 0.40;  // px
constexpr double kWorstView = 0.60;  // px
constexpr double kLengthOff = 0.0005;
constexpr double kLeftOut = 0.4;
constexpr double kFewestPoses = 8.0;
constexpr double kUncovered = 0.5;
constexpr double kFocalUnsure = 0.002;
constexpr double kVignettingUnsure = 0.005;
constexpr double kPaperUneven = 0.02;  // rms of its light: glossy, or lit by something else, too

std::array<int, 2> camera_size(const StepContext& context) {
  return {context.taker.camera().width, context.taker.camera().height};
}

std::array<int, 2> projector_size(const StepContext& context) {
  return {context.taker.projector().width, context.taker.projector().height};
}

std::string left_out(const PairFit& fit) {
  std::vector<std::string> names;
  for (const ViewFit& view : fit.views) {
    if (!view.kept()) names.push_back(fmt::format("{} ({})", view.name, view.reason));
  }
  return names.empty() ? "no pose was left out"
                       : fmt::format("left out: {}", fmt::join(names, "; "));
}

double mean_length(const PairFit& fit, const Board& board, const Poses& poses) {
  const auto lengths = row_lengths(fit, board, poses.camera, poses.projector);
  if (lengths.empty()) return std::nan("");
  return std::accumulate(lengths.begin(), lengths.end(), 0.0) / static_cast<double>(lengths.size());
}

std::vector<Gate> geometry_gates(const PairFit& fit, double length_error) {
  const double all = static_cast<double>(fit.views.size());
  const double kept = fit.kept();
  const double unsure = std::max(fit.deviation[0][0] / fit.joint_camera.fx,
                                 fit.deviation[1][0] / fit.joint_projector.fx);
  const std::string why = left_out(fit);
  return {
      {"wrong board size",
       std::abs(length_error),
       kLengthOff,
       "off the known length",
       "measure the board's squares and its known length again: [calibration.board] in the rig "
       "file"},
      {"poses left out", 1.0 - kept / all, kLeftOut, "of all poses", why},
      {"too few poses", kFewestPoses / std::max(kept, 1.0), 1.0, "of those kept are needed", why},
      {"worst pose", fit.worst_view_px, kWorstView, "px", "hold the board still and flat; " + why},
      {"coverage of the picture",
       1.0 - fit.camera.coverage,
       kUncovered,
       "of its fields have no corner",
       "show the board in the picture's corners, too"},
      {"focal length unsure",
       unsure,
       kFocalUnsure,
       "of it",
       "tilt the board more, and in all directions"},
      {"camera reprojection", fit.camera.rms_px, kLensRms, "px", "a flat board, in focus; " + why},
      {"projector reprojection",
       fit.projector.rms_px,
       kLensRms,
       "px",
       "focus the projector on the board; " + why},
      {"stereo reprojection",
       fit.stereo_rms_px,
       kStereoRms,
       "px",
       "nothing but the board may move; " + why}};
}

nlohmann::json values_of(const PairFit& fit,
                         const Board& board,
                         double length_mm,
                         double length_error) {
  nlohmann::json poses = nlohmann::json::array();
  for (const ViewFit& view : fit.views) {
    const PoseLie lie = view.kept() ? lie_of(view.camera_from_board, board) : PoseLie{};
    poses.push_back({{"name", view.name},
                     {"rms_px", view.rms_px},
                     {"blur_px", view.blur_px},
                     {"corners", view.corners},
                     {"right_deg", lie.right_deg},
                     {"down_deg", lie.down_deg},
                     {"distance_mm", lie.distance_mm},
                     {"left_out", view.reason}});
  }
  const Vec3 place = fit.joint_projector.centre();
  return {{"camera_rms_px", fit.camera.rms_px},
          {"projector_rms_px", fit.projector.rms_px},
          {"stereo_rms_px", fit.stereo_rms_px},
          {"worst_pose_px", fit.worst_view_px},
          {"median_pose_px", fit.median_view_px},
          {"poses_kept", fit.kept()},
          {"poses_left_out", left_out(fit)},
          {"coverage", fit.camera.coverage},
          {"length_mm", length_mm},
          {"length_error", length_error},
          {"camera_focal_px", fit.joint_camera.fx},
          {"camera_focal_deviation_px", fit.deviation[0][0]},
          {"projector_focal_px", fit.joint_projector.fx},
          {"projector_focal_deviation_px", fit.deviation[1][0]},
          {"projector_centre_mm", {place.x, place.y, place.z}},
          {"poses", std::move(poses)}};
}

// Taken over where it is told well; a board that cannot tell it (markers, few squares) leaves the rig file's.
void note_vignetting(const PairFit& fit,
                     const Poses& poses,
                     Measured& measured,
                     nlohmann::json& values) {
  measured.camera_vignetting.reset();
  measured.projector_vignetting.reset();
  const auto found = fit_vignetting(fit, poses.paper);
  if (!found) {
    values["vignetting_not_told"] = found.error().message;
    return;
  }
  values["vignetting_residual"] = found->residual;
  values["vignetting_deviation"] = found->deviation;
  values["camera_light_in_corners"] = found->at(0, 1.0);
  values["projector_light_in_corners"] = found->at(1, 1.0);
  if (std::ranges::max(found->deviation) > kVignettingUnsure || found->residual > kPaperUneven) {
    values["vignetting_not_told"] = fmt::format(
        "known to {:.2f} and {:.2f} %, the paper's light to {:.2f} %; at most {} and {} % are "
        "taken over",
        100.0 * found->deviation[0],
        100.0 * found->deviation[1],
        100.0 * found->residual,
        100.0 * kVignettingUnsure,
        100.0 * kPaperUneven);
    return;
  }
  measured.camera_vignetting = capture::Vignetting{found->coefficients[0]};
  measured.projector_vignetting = capture::Vignetting{found->coefficients[1]};
}

StepRecord too_few(StepRecord record, const Error& error) {
  record.gates.push_back({"too few poses", 2.0, 1.0, "", error.message});
  return record;
}

}  // namespace

Result<void> validate(const GeometryOptions& options) {
  if (!options.has_board()) return ok();
  if (auto good = validate(options.board); !good) return good;
  if (options.poses < 6 || options.poses > 100)
    return invalid_argument(fmt::format("board: poses = {}; expected 6 to 100", options.poses));
  if (options.projected == GeometryOptions::Projected::kChessboards &&
      options.board.kind != Board::Kind::kChessboard)
    return invalid_argument(
        "board: projector = \"chessboards\" with kind = \"charuco\"; expected kind = "
        "\"chessboard\", "
        "for markers leave no white paper to project corners on");
  if (!(options.board.known_length_mm > 0.0))
    return invalid_argument(
        "board: known_length is missing; measure with a calliper from the first to the last inner "
        "corner of a row");
  return ok();
}

Result<StepRecord> geometry(StepContext& context) {
  StepRecord record{"geometry", {}, {}, {}};
  const Board& board = context.geometry.board;
  if (auto good = validate(context.geometry); !good) return good.error();
  const auto brightness = find_brightness(context);
  if (!brightness) return brightness.error();
  record.gates = brightness_gates(*brightness);
  if (!record.accepted()) return record;
  const auto poses = take_poses(context, *brightness);
  if (!poses) return poses.error();
  context.progress(1.0, "bundle adjustment");
  const auto fit = fit_pair(camera_size(context),
                            projector_size(context),
                            board,
                            poses->camera,
                            poses->projector,
                            {},
                            context.stop);
  if (!fit && fit.error().code == ErrorCode::kCancelled) return fit.error();
  if (!fit) return too_few(std::move(record), fit.error());
  const double length_mm = mean_length(*fit, board, *poses);
  const double error = length_mm / board.known_length_mm - 1.0;
  for (Gate& gate : geometry_gates(*fit, error)) record.gates.push_back(std::move(gate));
  record.values = values_of(*fit, board, length_mm, error);
  record.values["residuals"] = residuals_of(*fit, board, poses->camera, poses->projector);
  context.record.measured.camera_lens = MeasuredLens{fit->joint_camera, fit->deviation[0]};
  context.record.measured.projector_lens = MeasuredLens{fit->joint_projector, fit->deviation[1]};
  note_vignetting(*fit, *poses, context.record.measured, record.values);
  return record;
}

}  // namespace opaline::calibration
