#include "render/deform/deformation.h"

#include "render/deform/cage.h"
#include "render/deform/skeleton.h"

namespace opaline::render {
namespace {

/// A deformation told in an object's own frame.
class PlacedDeformation final : public Deformation {
 public:
  PlacedDeformation(std::unique_ptr<Deformation> own, const Pose& scene_from_object)
      : own_(std::move(own)),
        scene_from_object_(scene_from_object),
        object_from_scene_(scene_from_object.inverse()) {}
  Vec3 at(Vec3 rest) const override {
    return scene_from_object_.apply(own_->at(object_from_scene_.apply(rest)));
  }

 private:
  std::unique_ptr<Deformation> own_;
  Pose scene_from_object_;
  Pose object_from_scene_;
};

}  // namespace

Vec3 Deformation::normal(Vec3 rest, Vec3 normal, double step) const {
  const auto slope = [&](Vec3 along) {
    return (at(rest + along * step) - at(rest - along * step)) * (0.5 / step);
  };
  const Vec3 x = slope({1.0, 0.0, 0.0});
  const Vec3 y = slope({0.0, 1.0, 0.0});
  const Vec3 z = slope({0.0, 0.0, 1.0});
  const Vec3 turned = cross(y, z) * normal.x + cross(z, x) * normal.y + cross(x, y) * normal.z;
  const double size = length(turned);
  return size > 0.0 ? turned * (1.0 / size) : Vec3{};
}

Result<std::unique_ptr<Deformation>> make_deformation(const DeformOptions& options,
                                                      const Box& bounds,
                                                      const Pose& scene_from_object) {
  if (auto valid = validate(options); !valid) return valid.error();
  std::unique_ptr<Deformation> own;
  if (options.kind == DeformOptions::Kind::kCage) own = std::make_unique<Cage>(options, bounds);
  if (options.kind == DeformOptions::Kind::kBones) own = std::make_unique<Skeleton>(options);
  if (!own) return invalid_argument("kind: expected a cage or bones");
  return std::unique_ptr<Deformation>(
      std::make_unique<PlacedDeformation>(std::move(own), scene_from_object));
}

}  // namespace opaline::render
