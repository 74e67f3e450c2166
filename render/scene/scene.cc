#include "render/scene/scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "render/scene/lighting.h"

namespace opaline::render {
namespace {

Result<void> check_colour(const Colour& colour, const char* what, double lowest, double highest) {
  for (const double value : colour) {
    if (!(value >= lowest && value <= highest)) {
      return invalid_argument(
          fmt::format("{} has {}; expected {} to {}", what, value, lowest, highest));
    }
  }
  return ok();
}

Result<void> check_shape(const ObjectOptions& object) {
  const ShapeOptions& shape = object.shape;
  if (shape.name.empty() == shape.file.empty()) {
    return invalid_argument("shape and file: expected one of them");
  }
  if (!shape.name.empty() && !(shape.size_mm > 0.0)) {
    return invalid_argument("size: expected more than 0 mm for a shape by name");
  }
  if (!(shape.unit_mm > 0.0) || !(shape.size_mm >= 0.0)) {
    return invalid_argument("unit and size: expected lengths");
  }
  if (shape.name == "plane" && object.kind == ObjectOptions::Kind::kTranslucent) {
    return invalid_argument("a plane encloses nothing: it can only be opaque");
  }
  return ok();
}

Result<void> check_translucent(const TranslucentOptions& material) {
  constexpr double kMost = 1e6;
  const bool named = material.file.empty();
  if (auto r = check_colour(material.absorption, "absorption", 0.0, kMost); named && !r) return r;
  if (auto r = check_colour(material.reduced_scattering, "reduced_scattering", 1e-6, kMost);
      named && !r) {
    return r;
  }
  if (material.pattern.kind != PatternOptions::Kind::kNone) {
    const PatternOptions& pattern = material.pattern;
    if (!named) return invalid_argument("pattern: expected either a file or a pattern");
    if (!(pattern.size_mm >= 1e-6))
      return invalid_argument("pattern.size: expected 1e-6 mm or more");
    for (const auto& [first, second, what] :
         {std::tuple{material.absorption, pattern.absorption, "absorption"},
          std::tuple{
              material.reduced_scattering, pattern.reduced_scattering, "reduced_scattering"}}) {
      for (const Colour& colour : {first, second}) {
        if (auto r = check_colour(colour, what, 1e-9, kMost); !r) {
          return r.error().in("pattern, which mixes logarithms");
        }
      }
    }
  }
  if (!(material.ior >= 1.0 && material.ior <= 3.0)) {
    return invalid_argument(fmt::format("ior = {}; expected 1 to 3", material.ior));
  }
  if (!(material.scale > 0.0)) return invalid_argument("scale: expected more than 0");
  if (material.edit_cells < 1 || material.edit_cells > 1024) {
    return invalid_argument("edit_cells: expected 1 to 1024");
  }
  return ok();
}

Result<void> check_object(const ObjectOptions& object) {
  if (auto r = check_shape(object); !r) return r;
  if (!(object.surface.roughness >= 0.01 && object.surface.roughness <= 1.0)) {
    return invalid_argument(
        fmt::format("roughness = {}; expected 0.01 to 1", object.surface.roughness));
  }
  if (auto r = validate(object.deform); !r) return r.error().in("deform");
  for (std::size_t k = 0; k < object.edits.size(); ++k) {
    if (auto r = validate(object.edits[k]); !r) return r.error().in(fmt::format("edit {}", k + 1));
  }
  if (object.kind == ObjectOptions::Kind::kTranslucent) return check_translucent(object.material);
  if (!(object.opaque_ior >= 1.0 && object.opaque_ior <= 3.0)) {
    return invalid_argument(fmt::format("ior = {}; expected 1 to 3", object.opaque_ior));
  }
  return check_colour(object.reflectance, "reflectance", 0.0, 1.0);
}

Result<void> check_light(const LightOptions& light) {
  const bool far = light.kind == LightOptions::Kind::kDirectional;
  const bool disc = light.kind == LightOptions::Kind::kDisc;
  const Colour& strength = far ? light.irradiance : disc ? light.radiance : light.intensity;
  const char* what = far ? "irradiance" : disc ? "radiance" : "intensity";
  if (auto r = check_colour(strength, what, 0.0, 1e12); !r) return r;
  if (is_black(strength)) return invalid_argument(fmt::format("{}: expected light", what));
  if (light.kind != LightOptions::Kind::kPoint && !(length(light.direction) > 0.0)) {
    return invalid_argument("direction: expected a vector that is not 0");
  }
  if (disc && !(light.radius_mm > 0.0)) return invalid_argument("radius: expected more than 0 mm");
  if (disc && (light.samples < 1 || light.samples > 256)) {
    return invalid_argument(fmt::format("samples = {}; expected 1 to 256", light.samples));
  }
  if (light.kind != LightOptions::Kind::kSpot) return ok();
  if (!(light.cone_degrees > 0.0 && light.cone_degrees <= 90.0)) {
    return invalid_argument("cone: expected more than 0 deg, at most 90 deg");
  }
  if (!(light.blur_degrees >= 0.0 && light.blur_degrees <= light.cone_degrees)) {
    return invalid_argument("blur: expected 0 deg to the cone");
  }
  return ok();
}

Result<void> check_camera(const CameraOptions& camera) {
  const Vec3 view = camera.target - camera.position;
  if (!(length(view) > 0.0)) return invalid_argument("position: expected other than the target");
  if (!(length(cross(normalized(view), camera.up)) > 1e-6 * length(camera.up)) ||
      !(length(camera.up) > 0.0)) {
    return invalid_argument("up: expected a direction that is not along the view");
  }
  if (!(camera.field_of_view_degrees > 0.0 && camera.field_of_view_degrees < 180.0)) {
    return invalid_argument("field_of_view: expected more than 0 deg, less than 180 deg");
  }
  return ok();
}

Result<void> check_picture(const PictureOptions& picture) {
  if (picture.width < 1 || picture.height < 1 || picture.width > 16384 || picture.height > 16384) {
    return invalid_argument("width and height: expected 1 to 16384");
  }
  if (picture.samples_per_axis < 1 || picture.samples_per_axis > 16) {
    return invalid_argument("samples: expected 1 to 16");
  }
  if (picture.refinement < 0 || picture.refinement > 4) {
    return invalid_argument("refinement: expected 0 to 4");
  }
  if (!(std::abs(picture.exposure) <= 100.0) || !(picture.white >= 0.0)) {
    return invalid_argument("exposure and white: expected -100 to 100 stops, and at least 0");
  }
  return check_colour(picture.background, "background", 0.0, 1.0);
}

Result<void> check_diffusion(const DiffusionOptions& diffusion) {
  if (!(diffusion.tolerance >= 1e-12 && diffusion.tolerance <= 0.1)) {
    return invalid_argument("tolerance: expected 1e-12 to 0.1");
  }
  if (diffusion.max_iterations < 1) return invalid_argument("max_iterations: expected at least 1");
  if (diffusion.levels < 1 || diffusion.levels > 20) {
    return invalid_argument("levels: expected 1 to 20");
  }
  if (!(diffusion.spacing_mm >= 0.0)) return invalid_argument("spacing: expected at least 0 mm");
  if (!(diffusion.tetrahedra >= 100.0 && diffusion.tetrahedra <= 2e7)) {
    return invalid_argument("tetrahedra: expected 100 to 2e7");
  }
  if (!(diffusion.interior_growth >= 0.0 && diffusion.interior_growth <= 10.0)) {
    return invalid_argument("interior_growth: expected 0 to 10");
  }
  if (diffusion.single_scattering &&
      (diffusion.entry != Entry::kCollimated || diffusion.method == Discretisation::kPolygrid)) {
    return invalid_argument(
        "single_scattering: it is of beams: expected collimated entry, and no polygrid");
  }
  return ok();
}

Result<void> named(const Result<void>& result, std::string_view where) {
  return result ? ok() : Result<void>(result.error().in(where));
}

}  // namespace

Result<void> validate(const Scene& scene) {
  if (scene.objects.empty()) return invalid_argument("objects: expected at least one");
  if (auto r = named(check_picture(scene.picture), "picture"); !r) return r;
  if (auto r = named(check_camera(scene.camera), "camera"); !r) return r;
  if (auto r = named(check_diffusion(scene.diffusion), "diffusion"); !r) return r;
  if (auto r =
          named(check_colour(scene.environment.radiance, "radiance", 0.0, 1e12), "environment");
      !r) {
    return r;
  }
  if (scene.environment.rays < 0 || scene.environment.rays > 4096) {
    return invalid_argument("environment: rays: expected 0 to 4096");
  }
  if (scene.lights.empty() && is_black(scene.environment.radiance)) {
    return invalid_argument("nothing shines: expected a light, or an environment with radiance");
  }
  for (const LightOptions& light : scene.lights) {
    if (auto r = named(check_light(light), fmt::format("light \"{}\"", light.name)); !r) return r;
  }
  for (const ObjectOptions& object : scene.objects) {
    if (auto r = named(check_object(object), fmt::format("object \"{}\"", object.name)); !r) {
      return r;
    }
  }
  return ok();
}

}  // namespace opaline::render
