#pragma once

#include <memory>
#include <vector>

#include "drivers/stage_picture.h"
#include "sim/led_sphere.h"
#include "sim/rig.h"

namespace opaline::support {

/// A small sphere of lights around one ball of 8 mm, seen from 1 m by 48 x 48 pixels of 0.4 mm.
struct TinySphere {
  std::vector<SphereLight> lights = light_sphere(60, 500.0, 1.0);
  sim::LedSphereOptions sphere;
  sim::RigOptions rig;

  TinySphere() {
    sphere.radii_mm = {8.0};
    sphere.paths = 10'000;
    CameraModel& model = rig.camera.model;
    model.width = model.height = 48;
    model.fx = model.fy = 2500.0;
    model.cx = model.cy = 24.0;
    model.distortion = {};
    model.camera_from_sample = look_at({0.0, 0.0, 1000.0}, {0.0, 0.0, 0.0}, {0.0, 1.0, 0.0});
    rig.projector.width = static_cast<int>(lights.size()) + 1;
    rig.projector.height = 1;
    rig.projector.color_wheel = false;
    rig.projector.wheel_turn = std::chrono::milliseconds(1);
    rig.time_factor = 1000.0;
  }
  std::unique_ptr<const sim::LedSphere> path() const {
    NullSink events;
    return *sim::LedSphere::create(sphere, lights, rig.camera, events, {});
  }
  /// `path` may be shared: to trace it takes a while.
  std::unique_ptr<sim::Rig> make_rig(std::shared_ptr<const sim::LightPath> path,
                                     Clock* clock = nullptr) const {
    return *sim::Rig::create(rig, std::move(path), clock);
  }
  Image<std::uint8_t> all(std::uint8_t code,
                          drivers::Polarization how = drivers::Polarization::kCross) const {
    return drivers::stage_picture({1, std::vector<std::uint8_t>(lights.size(), code), how}).codes;
  }
};

}  // namespace opaline::support
