// What a session believes of its camera and projector once both have been measured and the sample has been found.

#include "calibration/measured_station.h"

#include <gtest/gtest.h>

#include <cmath>

namespace opaline::calibration {
namespace {

/// A camera and a projector about the sample, and what boards tell of the two: the projector's pose in the camera's frame.
struct Truth {
  CameraModel camera{.width = 400,
                     .height = 400,
                     .fx = 2500,
                     .fy = 2500,
                     .cx = 200,
                     .cy = 200,
                     .camera_from_sample = look_at({100, 10, 280}, {12, 12, 12}, {0.0, 1.0, 0.0})};
  CameraModel projector{
      .width = 640,
      .height = 480,
      .fx = 3300,
      .fy = 3310,
      .cx = 325,
      .cy = 236,
      .camera_from_sample = look_at({30, -30, 300}, {12, 12, 12}, {0.0, 1.0, 0.0})};

  /// By three points, for no product of poses is to be believed here: where the projector sees what lies on the camera's axes.
  Measured measured() const {
    const Pose sample_from_camera = camera.camera_from_sample.inverse();
    const auto seen = [&](Vec3 in_camera) {
      return projector.camera_from_sample.apply(sample_from_camera.apply(in_camera));
    };
    const Vec3 o = seen({0, 0, 0});
    const Vec3 x = seen({1, 0, 0}) - o;
    const Vec3 y = seen({0, 1, 0}) - o;
    const Vec3 z = seen({0, 0, 1}) - o;
    Measured m;
    m.projector_lens = MeasuredLens{projector, {}};
    m.projector_lens->model.camera_from_sample = {{x.x, y.x, z.x, x.y, y.y, z.y, x.z, y.z, z.z}, o};
    return m;
  }
};

capture::StationCalibration believed(capture::ProjectorKind kind) {
  capture::StationCalibration given;
  given.camera.model.camera_from_sample = look_at({90, 0, 270}, {12, 12, 12}, {0.0, 1.0, 0.0});
  given.projector.kind = kind;
  given.projector.lens.fx = given.projector.lens.fy = 3000;
  return given;
}

TEST(MeasuredStation, TheProjectorStandsWhereBoardsAndHolderHaveItTogether) {
  const Truth truth;
  const auto placed = with_place(believed(capture::ProjectorKind::kPerspective),
                                 truth.measured(),
                                 truth.camera.camera_from_sample,
                                 {});
  EXPECT_EQ(placed.camera.model.camera_from_sample, truth.camera.camera_from_sample);
  for (const Vec3 point : {Vec3{0, 0, 12}, Vec3{24, 0, 12}, Vec3{5, 24, 0}}) {
    const auto should = truth.projector.project(point);
    const auto is = placed.projector.lens.project(point);
    EXPECT_NEAR(is.x, should.x, 1e-6);
    EXPECT_NEAR(is.y, should.y, 1e-6);
  }
}

TEST(MeasuredStation, WithoutAHolderTheProjectorGoesWithTheCameraOfTheRigFile) {
  const Truth truth;
  const auto given = believed(capture::ProjectorKind::kPerspective);
  const auto station = with_measured(given, truth.measured());
  const Vec3 camera_eye = given.camera.model.centre();
  EXPECT_NEAR(length(station.projector.lens.centre() - camera_eye),
              length(truth.projector.centre() - truth.camera.centre()),
              1e-6);
  EXPECT_EQ(station.projector.lens.fx, 3300.0);
}

TEST(MeasuredStation, APerpendicularProjectorStaysAsTheRigFileHasIt) {
  const Truth truth;
  const auto given = believed(capture::ProjectorKind::kPerpendicular);
  const auto placed = with_place(given, truth.measured(), truth.camera.camera_from_sample, {});
  EXPECT_EQ(placed.projector.lens, given.projector.lens);
}

// A motion of the sample that the camera would see as (w, s) is (R w, R s) to the projector: the variance of any component agrees with that of the
// place at which the moved sample's points lie in its frame.
TEST(MeasuredStation, TheProjectorsPlaceIsAsUnsureAsTheCamerasFromWhereItStands) {
  const Truth truth;
  const Measured measured = truth.measured();
  for (std::size_t k = 0; k < 6; ++k) {
    std::array<double, 36> covariance{};
    covariance[7 * k] = 1e-6;  // one motion alone, 1e-3
    const auto placed = with_place(believed(capture::ProjectorKind::kPerspective),
                                   measured,
                                   truth.camera.camera_from_sample,
                                   covariance);
    Vec3 w;
    Vec3 s;
    (k % 3 == 0 ? (k < 3 ? w : s).x : k % 3 == 1 ? (k < 3 ? w : s).y : (k < 3 ? w : s).z) = 1e-3;
    const Vec3 point{20, 3, 12};
    const Pose& camera = truth.camera.camera_from_sample;
    const Vec3 moved = camera.apply(point) + cross(w, camera.rotate(point)) + s;
    const Vec3 seen = measured.projector_lens->model.camera_from_sample.apply(moved) -
                      placed.projector.lens.camera_from_sample.apply(point);
    // The same from the projector's covariance, whose rank is one: its motion is the root of the diagonal with the signs of a row.
    const auto& c = placed.projector.place_covariance;
    std::size_t most = 0;
    for (std::size_t i = 1; i < 6; ++i) most = c[7 * i] > c[7 * most] ? i : most;
    std::array<double, 6> motion{};
    for (std::size_t i = 0; i < 6; ++i) motion[i] = c[6 * most + i] / std::sqrt(c[7 * most]);
    const Vec3 predicted = cross({motion[0], motion[1], motion[2]},
                                 placed.projector.lens.camera_from_sample.rotate(point)) +
                           Vec3{motion[3], motion[4], motion[5]};
    const double sign = dot(predicted, seen) < 0.0 ? -1.0 : 1.0;
    EXPECT_NEAR(length(predicted * sign - seen), 0.0, 1e-9) << k;
  }
}

}  // namespace
}  // namespace opaline::calibration
