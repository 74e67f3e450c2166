#include "render/scene_buffer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace opaline::render {
namespace {

constexpr double kMargin = 0.01;  // as in block.vert
constexpr int kLargestSide = 1 << 16;

float f(double value) { return static_cast<float>(value); }
double component(Vec3 v, int axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; }

Result<void> validate(const CameraModel& camera) {
  if (camera.width < 1 || camera.height < 1 || std::max(camera.width, camera.height) > kLargestSide)
    return invalid_argument(fmt::format("a camera of {} x {} pixels; expected 1 to {} a side",
                                        camera.width,
                                        camera.height,
                                        kLargestSide));
  if (!(camera.fx > 0.0 && camera.fy > 0.0))
    return invalid_argument(
        fmt::format("focal lengths {} and {} pixels; expected > 0", camera.fx, camera.fy));
  const auto& r = camera.camera_from_sample.rotation;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      double product = i == j ? -1.0 : 0.0;
      for (int k = 0; k < 3; ++k) product += r[3 * i + k] * r[3 * j + k];
      if (!(std::abs(product) < 1e-6))
        return invalid_argument("the camera's rotation is no rotation");
    }
  return ok();
}

bool inside(const Block& block, Vec3 p) {
  const Vec3 size = block.size();
  return p.x >= 0 && p.x <= size.x && p.y >= 0 && p.y <= size.y && p.z >= 0 && p.z <= size.z;
}

/// The depth of the block's nearest corner, mm, its faces grown by the margin.
double nearest_depth(const Block& block, const CameraModel& camera) {
  const Vec3 size = block.size();
  double nearest = HUGE_VAL;
  for (int corner = 0; corner < 8; ++corner) {
    const auto at = [&](int bit, double length) {
      return (corner >> bit & 1) != 0 ? length * (1.0 + kMargin) : -length * kMargin;
    };
    const Vec3 p{at(0, size.x), at(1, size.y), at(2, size.z)};
    nearest = std::min(nearest, camera.camera_from_sample.apply(p).z);
  }
  return nearest;
}

SceneBuffer::IVec4 visible_faces(const Block& block, Vec3 centre) {
  SceneBuffer::IVec4 visible{0, 0, 0, 0};
  for (const Face face : kFaces) {
    const double at = component(centre, axis_of(face));
    const bool seen = is_max(face) ? at > component(block.size(), axis_of(face)) : at < 0.0;
    if (seen) visible[visible[3]++] = static_cast<std::int32_t>(face);
  }
  return visible;
}

std::array<SceneBuffer::IVec4, 2> first_cells(const Block& block) {
  std::array<SceneBuffer::IVec4, 2> first{};
  std::size_t next = 0;
  for (std::size_t i = 0; i < kFaces.size(); ++i) {
    first[i / 4][i % 4] = static_cast<std::int32_t>(next);
    next += block.face_cell_count(kFaces[i]);
  }
  return first;
}

}  // namespace

Result<SceneBuffer> describe_scene(const SurfaceField& field,
                                   const CameraModel& camera,
                                   int samples_per_axis) {
  if (auto good = validate(camera); !good) return good.error();
  const Block& b = field.block;
  const Vec3 centre = camera.centre();
  if (inside(b, centre)) return invalid_argument("the camera stands inside the sample");
  const double nearest = nearest_depth(b, camera);
  if (!(nearest > 1e-3 * length(b.size())))
    return invalid_argument("the sample is not wholly in front of the camera");
  const Pose& pose = camera.camera_from_sample;
  const auto& r = pose.rotation;
  const auto& d = camera.distortion;
  SceneBuffer scene{};
  scene.camera_from_sample = {{{f(r[0]), f(r[1]), f(r[2]), f(pose.translation.x)},
                               {f(r[3]), f(r[4]), f(r[5]), f(pose.translation.y)},
                               {f(r[6]), f(r[7]), f(r[8]), f(pose.translation.z)}}};
  scene.centre = {f(centre.x), f(centre.y), f(centre.z), 0.0F};
  scene.focal = {f(camera.fx), f(camera.fy), f(camera.cx), f(camera.cy)};
  scene.distortion = {f(d[0]), f(d[1]), f(d[2]), f(d[3])};
  scene.optics = {f(d[4]), f(field.ior), f(0.99 * nearest), f(samples_per_axis)};
  scene.spacing = {f(b.hx), f(b.hy), f(b.hz), 0.0F};
  scene.cells = {b.nx, b.ny, b.nz, kSegments};
  scene.visible = visible_faces(b, centre);
  scene.first = first_cells(b);
  return scene;
}

std::vector<float> pack_field(const SurfaceField& field) {
  std::vector<float> packed;
  for (const FaceField& face : field.faces) {
    const auto fluence = face.fluence.samples();
    const auto flux = face.net_flux.samples();
    const auto reflected = face.reflected.samples();
    for (std::size_t i = 0; i < fluence.size(); i += 3) {
      packed.insert(packed.end(), {fluence[i], fluence[i + 1], fluence[i + 2], 0.0F});
      packed.insert(packed.end(), {flux[i], flux[i + 1], flux[i + 2], 0.0F});
      packed.insert(packed.end(), 4, 0.0F);
      if (!reflected.empty()) std::copy_n(&reflected[i], 3, packed.end() - 4);
    }
  }
  return packed;
}

}  // namespace opaline::render
