#include "calibration/placement.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <vector>

#include "calibration/pose_chain.h"
#include "calibration/zhang.h"

namespace opaline::calibration {
namespace {

constexpr int kFewestHolderCorners = 8;
constexpr double kMostLeftPx = 0.3;
constexpr double kMostUnsure = 0.1;  // mm
constexpr double kFarOff = 4.5;      // deviations
constexpr double kMedianOfDistance = 1.1774;
constexpr int kMostTurns = 50;
constexpr double kTurnStill = 1e-12;  // rad
constexpr double kMoveStill = 1e-9;   // mm
constexpr int kPlacementFormat = 1;

using Motion = Eigen::Matrix<double, 6, 1>;
using Rotation = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

struct Marked {
  Vec3 point;  // in the sample's frame
  CameraModel::Pixel pixel;
};

Rotation rotation_of(const Pose& pose) { return Eigen::Map<const Rotation>(pose.rotation.data()); }

Pose moved(const Pose& pose, const Motion& motion) {
  const Eigen::Vector3d w = motion.head<3>();
  const double angle = w.norm();
  Rotation turned = rotation_of(pose);
  if (angle > 0.0) turned = Eigen::AngleAxisd(angle, w / angle).toRotationMatrix() * turned;
  Pose out;
  Eigen::Map<Rotation>(out.rotation.data()) = turned;
  out.translation = pose.translation + Vec3{motion[3], motion[4], motion[5]};
  return out;
}

Eigen::Vector2d missed(CameraModel lens, const Pose& pose, const Marked& mark) {
  lens.camera_from_sample = pose;
  const auto p = lens.project(mark.point);
  return {mark.pixel.x - p.x, mark.pixel.y - p.y};
}

// Of the projection, by central differences over the motion.
Eigen::Matrix<double, 2, 6> slope_of(const CameraModel& lens,
                                     const Pose& pose,
                                     const Marked& mark) {
  Eigen::Matrix<double, 2, 6> slope;
  for (int k = 0; k < 6; ++k) {
    Motion step = Motion::Zero();
    step[k] = k < 3 ? 1e-6 : 1e-4;
    slope.col(k) =
        (missed(lens, moved(pose, -step), mark) - missed(lens, moved(pose, step), mark)) /
        (2.0 * step[k]);
  }
  return slope;
}

struct Solved {
  Pose pose;
  Eigen::Matrix<double, 6, 6> normal = Eigen::Matrix<double, 6, 6>::Zero();
  double squares = 0.0;
};

Solved solve(const CameraModel& lens, const Pose& from, const std::vector<Marked>& marks) {
  Solved solved{from};
  for (int n = 0; n < kMostTurns; ++n) {
    solved.normal.setZero();
    solved.squares = 0.0;
    Motion right = Motion::Zero();
    for (const Marked& mark : marks) {
      const auto slope = slope_of(lens, solved.pose, mark);
      const Eigen::Vector2d off = missed(lens, solved.pose, mark);
      solved.normal += slope.transpose() * slope;
      right += slope.transpose() * off;
      solved.squares += off.squaredNorm();
    }
    const Motion step = solved.normal.ldlt().solve(right);
    if (step.head<3>().norm() < kTurnStill && step.tail<3>().norm() < kMoveStill) break;
    solved.pose = moved(solved.pose, step);
  }
  return solved;
}

std::vector<Marked> without_outliers(const CameraModel& lens,
                                     const Pose& pose,
                                     const std::vector<Marked>& marks) {
  std::vector<double> distances;
  for (const Marked& mark : marks) distances.push_back(missed(lens, pose, mark).norm());
  std::vector<double> sorted = distances;
  const auto middle = sorted.begin() + std::ssize(sorted) / 2;
  std::ranges::nth_element(sorted, middle);
  std::vector<Marked> kept;
  for (std::size_t i = 0; i < marks.size(); ++i) {
    if (distances[i] <= kFarOff * *middle / kMedianOfDistance) kept.push_back(marks[i]);
  }
  return kept;
}

// Of m = [w]x R p + s across the line of sight, the larger one.
double deviation_across(const Eigen::Matrix<double, 6, 6>& covariance,
                        const Pose& pose,
                        Vec3 point) {
  const Vec3 p = pose.rotate(point);
  Eigen::Matrix<double, 3, 6> motion;
  motion << 0.0, p.z, -p.y, 1.0, 0.0, 0.0, -p.z, 0.0, p.x, 0.0, 1.0, 0.0, p.y, -p.x, 0.0, 0.0, 0.0,
      1.0;
  const Vec3 sight = normalized(pose.apply(point));
  const Eigen::Vector3d d(sight.x, sight.y, sight.z);
  const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - d * d.transpose();
  const Eigen::Matrix3d variance = across * motion * covariance * motion.transpose() * across;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> values(variance, Eigen::EigenvaluesOnly);
  return std::sqrt(std::max(0.0, values.eigenvalues()[2]));
}

Placement placement_of(const Solved& solved, const std::vector<Marked>& marks) {
  Placement placement{solved.pose};
  const auto corners = static_cast<double>(marks.size());
  placement.corners = static_cast<int>(marks.size());
  placement.rms_px = std::sqrt(solved.squares / corners);
  const double variance = solved.squares / (2.0 * corners - 6.0);
  const Eigen::Matrix<double, 6, 6> covariance = variance * solved.normal.inverse();
  Eigen::Map<Eigen::Matrix<double, 6, 6, Eigen::RowMajor>>(placement.covariance.data()) =
      covariance;
  for (const Marked& mark : marks)
    placement.deviation_mm =
        std::max(placement.deviation_mm, deviation_across(covariance, solved.pose, mark.point));
  return placement;
}

}  // namespace

Result<void> validate(const HolderOptions& options) {
  if (!options.is_there() || options.board.kind == Board::Kind::kCharuco) return ok();
  return invalid_argument(
      "holder: kind = \"chessboard\"; expected \"charuco\", whose corners have "
      "names also where its middle is cut out");
}

Result<Placement> place_sample(const CameraModel& lens,
                               const HolderOptions& holder,
                               const BoardView& view) {
  if (!view.fault.empty())
    return invalid_argument(fmt::format("the sample's holder is not seen: {}", view.fault));
  if (static_cast<int>(view.corners.size()) < kFewestHolderCorners)
    return invalid_argument(fmt::format(
        "the sample's holder: {} corners seen, {} are needed; is it lit, and in the picture?",
        view.corners.size(),
        kFewestHolderCorners));
  const auto plane = board_homography(holder.board, view);
  if (!plane) return invalid_argument("the sample's holder: its corners lie on a line");
  const Pose from = chained(initial_pose(lens, *plane), holder.sample_from_board.inverse());
  std::vector<Marked> marks;
  for (const BoardCorner& corner : view.corners)
    marks.push_back({holder.sample_from_board.apply(holder.board.corner(corner.id)), corner.pixel});
  Solved solved = solve(lens, from, marks);
  const std::vector<Marked> kept = without_outliers(lens, solved.pose, marks);
  if (static_cast<int>(kept.size()) >= kFewestHolderCorners && kept.size() < marks.size()) {
    solved = solve(lens, solved.pose, kept);
    marks = kept;
  }
  const Placement placement = placement_of(solved, marks);
  if (placement.rms_px > kMostLeftPx)
    return invalid_argument(fmt::format(
        "the sample's holder: its corners are {:.2f} px off where a flat board of squares of "
        "{:.2f} "
        "mm would have them, and {:.1f} are allowed: is [calibration.holder] of this holder, and "
        "was the lens measured?",
        placement.rms_px,
        holder.board.square_mm,
        kMostLeftPx));
  if (!(placement.deviation_mm <= kMostUnsure))
    return invalid_argument(fmt::format(
        "the sample's holder: its place is unsure to {:.2f} mm from {} corners, and {:.1f} "
        "are allowed: show more of it",
        placement.deviation_mm,
        placement.corners,
        kMostUnsure));
  return placement;
}

std::string to_text(const Placement& placement) {
  const Pose& pose = placement.camera_from_sample;
  const Vec3 t = pose.translation;
  return nlohmann::json{{"format", kPlacementFormat},
                        {"rotation", pose.rotation},
                        {"translation_mm", {t.x, t.y, t.z}},
                        {"covariance", placement.covariance},
                        {"rms_px", placement.rms_px},
                        {"deviation_mm", placement.deviation_mm},
                        {"corners", placement.corners}}
             .dump(1) +
         "\n";
}

Result<Placement> placement_from_text(std::string_view text, const std::string& file) {
  try {
    const auto json = nlohmann::json::parse(text);
    if (json.at("format") != kPlacementFormat)
      return invalid_argument(fmt::format("{}: of a newer version", file));
    Placement placement;
    json.at("rotation").get_to(placement.camera_from_sample.rotation);
    const auto t = json.at("translation_mm").get<std::array<double, 3>>();
    placement.camera_from_sample.translation = {t[0], t[1], t[2]};
    json.at("covariance").get_to(placement.covariance);
    json.at("rms_px").get_to(placement.rms_px);
    json.at("deviation_mm").get_to(placement.deviation_mm);
    json.at("corners").get_to(placement.corners);
    return placement;
  } catch (const nlohmann::json::exception& e) {
    return invalid_argument(fmt::format("{}: damaged: {}", file, e.what()));
  }
}

}  // namespace opaline::calibration
