#include "render/scene/scene_renderer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "render/scene/solid.h"
#include "render/scene/team_work.h"

namespace opaline::render {
namespace {

constexpr double kOpaqueTetrahedra = 5e4;
constexpr double kCoarse = 1.0;      // spacings to the shortest diffusion length
constexpr double kFewFreePaths = 3;  // a body thinner than that many is not diffuse

Box own_bounds(const TriangleMesh& surface, const Pose& scene_from_own) {
  TriangleMesh own;
  const Pose own_from_scene = scene_from_own.inverse();
  for (const Vec3& p : surface.vertices) own.vertices.push_back(own_from_scene.apply(p));
  return bounds(own);
}

}  // namespace

CameraModel camera_of(const CameraOptions& camera, const PictureOptions& picture) {
  CameraModel model;
  model.width = picture.width;
  model.height = picture.height;
  const double half = 0.5 * camera.field_of_view_degrees * std::numbers::pi / 180.0;
  model.fx = model.fy = 0.5 * picture.height / std::tan(half);
  model.cx = 0.5 * picture.width;
  model.cy = 0.5 * picture.height;
  model.camera_from_sample = look_at(camera.position, camera.target, camera.up);
  return model;
}

Result<std::unique_ptr<SceneRenderer>> SceneRenderer::create(const Scene& scene,
                                                             ThreadTeam& team,
                                                             const Step& step,
                                                             std::stop_token stop) {
  if (auto valid = validate(scene); !valid) return valid.error();
  auto made = std::unique_ptr<SceneRenderer>(new SceneRenderer(scene, team));
  double done = 0.0;
  for (const ObjectOptions& object : scene.objects) {
    const double share = done / static_cast<double>(scene.objects.size());
    step(fmt::format("preparing {}", object.name), share);
    const Saying say = [&](std::string_view what) {
      step(fmt::format("{}: {}", object.name, what), share);
    };
    if (auto added = made->add(object, say, stop); !added) {
      return added.error().in(fmt::format("object \"{}\"", object.name));
    }
    done += 1.0;
  }
  if (auto built = made->surfaces_.build(stop); !built) return built.error();
  step("visibility of the environment", 1.0);
  if (auto seen = made->look_at_sky(stop); !seen) return seen.error();
  return made;
}

Result<void> SceneRenderer::add(const ObjectOptions& object,
                                const Saying& say,
                                std::stop_token stop) {
  return object.kind == ObjectOptions::Kind::kTranslucent ? add_translucent(object, say, stop)
                                                          : add_opaque(object, say, stop);
}

Result<void> SceneRenderer::add_translucent(const ObjectOptions& object,
                                            const Saying& say,
                                            std::stop_token stop) {
  auto body = TranslucentBody::create(
      object, scene_.diffusion, scene_.picture.refinement, team_, stop, say);
  if (!body) return body.error();
  const Subsurface::Report& report = (*body)->subsurface().report();
  statistics_.load_seconds += (*body)->load_seconds();
  statistics_.mesh_seconds += report.mesh_seconds;
  statistics_.setup_seconds += report.setup_seconds;
  for (const std::string& note : (*body)->notes()) {
    statistics_.notes.push_back(fmt::format("{}: {}", object.name, note));
  }
  note_resolution(object, report);
  const DrawnSurface& drawn = (*body)->drawn();
  const int number = surfaces_.add(drawn.mesh(), drawn.normals());
  statistics_.objects.push_back({object.name, true, drawn.mesh().triangles.size(), report});
  looks_.push_back({.translucent = true, .ior = (*body)->ior(), .surface = object.surface});
  looks_.back().marks = (*body)->marks();
  looks_.back().finish = (*body)->finish();
  std::unique_ptr<SingleScattering> once;
  if (scene_.diffusion.single_scattering) {
    const Subsurface& solid = (*body)->subsurface();
    once = std::make_unique<SingleScattering>(
        *solid.beams(), solid.surface(), drawn, surfaces_, sources_, (*body)->ior());
    looks_.back().once = once.get();
  }
  bodies_.push_back({*std::move(body), std::move(once), number});
  opaque_.emplace_back();
  return ok();
}

Result<void> SceneRenderer::add_opaque(const ObjectOptions& object,
                                       const Saying& say,
                                       std::stop_token stop) {
  const SpentTime watch(statistics_.load_seconds);
  auto shape = load_opaque(object.shape, kOpaqueTetrahedra, stop, say);
  if (!shape) return shape.error();
  const bool by_name = shape->solid && object.shape.file.empty();
  Opaque opaque;
  opaque.rest = own_bounds(*shape->surface, scene_from_shape(object.shape));
  opaque.drawn = by_name ? std::make_unique<DrawnSurface>(
                               *std::move(shape->surface), *shape->solid, scene_.picture.refinement)
                         : std::make_unique<DrawnSurface>(*std::move(shape->surface));
  if (object.deform.kind != DeformOptions::Kind::kNone) {
    const auto deformation =
        make_deformation(object.deform, opaque.rest, scene_from_shape(object.shape));
    if (!deformation) return deformation.error().in("deform");
    opaque.drawn->bend(**deformation);
  }
  surfaces_.add(opaque.drawn->mesh(), opaque.drawn->normals());
  statistics_.objects.push_back({object.name, false, opaque.drawn->mesh().triangles.size(), {}});
  looks_.push_back({.translucent = false,
                    .ior = object.opaque_ior,
                    .surface = object.surface,
                    .reflectance = object.reflectance});
  opaque_.push_back(std::move(opaque));
  return ok();
}

void SceneRenderer::leave_out_single_scattering() {
  if (!scene_.diffusion.single_scattering) return;
  leave_out("single scattering: the rasteriser does not follow rays into objects");
  scene_.diffusion.single_scattering = false;
  for (Body& body : bodies_) body.body->subsurface().leave_out_single_scattering();
  for (Look& look : looks_) look.once = nullptr;
}

std::vector<SceneRenderer::DrawnObject> SceneRenderer::drawn() const {
  std::vector<DrawnObject> objects(looks_.size());
  for (std::size_t o = 0; o < looks_.size(); ++o) {
    objects[o] = {opaque_[o].drawn.get(), &looks_[o], scene_.objects[o].shape.name == "plane"};
  }
  for (const Body& body : bodies_) objects[body.object].surface = &body.body->drawn();
  return objects;
}

void SceneRenderer::set_tolerance(double tolerance) {
  scene_.diffusion.tolerance = tolerance;
  for (Body& body : bodies_) body.body->subsurface().set_tolerance(tolerance);
}

TranslucentBody* SceneRenderer::body(std::size_t object) {
  for (Body& body : bodies_) {
    if (body.object == static_cast<int>(object)) return body.body.get();
  }
  return nullptr;
}

Result<std::size_t> SceneRenderer::bend(std::size_t object,
                                        const DeformOptions& options,
                                        std::stop_token stop) {
  if (object >= looks_.size()) return invalid_argument(fmt::format("no object {}", object));
  std::size_t inverted = 0;
  if (TranslucentBody* const own = body(object)) {
    const auto bent = own->bend(options);
    if (!bent) return bent.error();
    inverted = *bent;
    looks_[object].marks = own->marks();
    surfaces_.move(static_cast<int>(object), own->drawn().mesh().vertices, own->drawn().normals());
  } else {
    DrawnSurface& drawn = *opaque_[object].drawn;
    const auto deformation = make_deformation(
        options, opaque_[object].rest, scene_from_shape(scene_.objects[object].shape));
    if (!deformation) return deformation.error();
    drawn.bend(**deformation);
    surfaces_.move(static_cast<int>(object), drawn.mesh().vertices, drawn.normals());
  }
  if (auto seen = look_at_sky(std::move(stop)); !seen) return seen.error();
  return inverted;
}

void SceneRenderer::note_resolution(const ObjectOptions& object, const Subsurface::Report& report) {
  const double tetrahedra = static_cast<double>(report.tetrahedra);
  if (report.spacing_mm > kCoarse * report.shortest_diffusion_length) {
    const double finer = report.spacing_mm / (kCoarse * report.shortest_diffusion_length);
    statistics_.notes.push_back(
        fmt::format("{}: light dies out within {:.3g} mm, and elements are {:.3g} mm long: about "
                    "{:.2g} tetrahedra would show it",
                    object.name,
                    report.shortest_diffusion_length,
                    report.spacing_mm,
                    tetrahedra * finer * finer * finer));
  }
  const double across = 4.0 * report.volume_mm3 / report.area_mm2;  // on average (Cauchy's chord)
  if (across < kFewFreePaths * report.shortest_free_path) {
    statistics_.notes.push_back(fmt::format(
        "{}: only {:.2g} transport mean free paths across: diffusion is a poor model of it",
        object.name,
        across / report.shortest_free_path));
  }
}

Result<Image<float>> SceneRenderer::draw(const CameraModel& camera, std::stop_token stop) {
  statistics_.draw_seconds = 0.0;
  const SpentTime watch(statistics_.draw_seconds);
  const Painter painter(surfaces_, looks_, sources_, scene_.environment);
  return painter.draw(camera, scene_.picture.samples_per_axis, team_, stop);
}

}  // namespace opaline::render
