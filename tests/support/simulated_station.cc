#include "tests/support/simulated_station.h"

#include <cmath>

namespace opaline::support {
namespace {

PatchResponse hill(const Block& block, double patch_x, double patch_y) {
  PatchResponse response{Image<float>(block.nx, block.ny, 3), Image<float>(block.nx, block.ny, 3)};
  for (int y = 0; y < block.ny; ++y) {
    for (int x = 0; x < block.nx; ++x) {
      const double dx = (x + 0.5) * block.hx - patch_x;
      const double dy = (y + 0.5) * block.hy - patch_y;
      const double radiance = 0.02 * std::exp(-(dx * dx + dy * dy) / 12.0);
      for (int c = 0; c < 3; ++c)
        response.radiance.at(x, y, c) = static_cast<float>(radiance * (1.0 - 0.2 * c));
    }
  }
  return response;
}

}  // namespace

std::shared_ptr<const TransportResponses> tiny_responses() {
  TransportResponses responses;
  responses.block = Block{8, 8, 4, 1.0, 1.0, 1.0};
  responses.patches_x = responses.patches_y = 4;
  responses.camera_centre = {4.0, 4.0, 104.0};
  responses.generator = "hills for tests";
  responses.scene = R"({"kind":"hills"})";
  for (int row = 0; row < 4; ++row) {
    for (int column = 0; column < 4; ++column) {
      responses.patches.push_back(hill(responses.block, 2.0 * column + 1.0, 2.0 * row + 1.0));
    }
  }
  return std::make_shared<const TransportResponses>(std::move(responses));
}

sim::RigOptions tiny_rig() {
  sim::RigOptions options;
  CameraModel& model = options.camera.model;
  model.width = model.height = 64;
  model.fx = model.fy = 500.0;  // 0.2 mm a pixel
  model.cx = model.cy = 32.0;
  model.distortion = {};
  model.camera_from_sample = look_at({4.0, 4.0, 104.0}, {4.0, 4.0, 4.0}, {0.0, 1.0, 0.0});
  options.projector.width = 80;
  options.projector.height = 60;
  options.projector.mm_per_pixel = 0.2;
  options.projector.offset_x_px = 20.0;
  options.projector.offset_y_px = 10.0;
  options.time_factor = 1000.0;
  return options;
}

drivers::Pattern flat_pattern(const sim::RigOptions& options, std::uint64_t id, std::uint8_t code) {
  return {id, Image<std::uint8_t>(options.projector.width, options.projector.height, 3, code)};
}

}  // namespace opaline::support
