#include "render/scene/scene_renderer.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <numbers>

#include "reconstruct/diffusion/fresnel.h"
#include "render/scene/material_source.h"
#include "render/scene/solid.h"

namespace opaline::render {
namespace {

using reconstruct::diffusion::fresnel_reflectance;

constexpr int kChunk = 256;
constexpr double kOpaqueTetrahedra = 5e4;
constexpr double kCoarse = 1.0;      // spacings to the shortest diffusion length
constexpr double kFewFreePaths = 3;  // a body thinner than that many is not diffuse

class Stopwatch {
 public:
  explicit Stopwatch(double& sum) : sum_(sum) {}
  ~Stopwatch() {
    sum_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }
  Stopwatch(const Stopwatch&) = delete;
  Stopwatch& operator=(const Stopwatch&) = delete;

 private:
  double& sum_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// Calls work(i) for 0 <= i < count on the team.
template <class Work>
void for_each(std::size_t count, ThreadTeam& team, const std::stop_token& stop, const Work& work) {
  std::atomic<std::size_t> next{0};
  team.run([&](int) {
    for (std::size_t first = next.fetch_add(kChunk); first < count && !stop.stop_requested();
         first = next.fetch_add(kChunk)) {
      for (std::size_t i = first; i < std::min(count, first + kChunk); ++i) work(i);
    }
  });
}

/// Of each drawn vertex the share of the sky that its place sees; 1 where places are not vertices.
std::vector<float> sky_share(const DrawnSurface& drawn, std::vector<float> places, double open) {
  if (places.size() != drawn.coarse()) {
    return std::vector<float>(drawn.mesh().vertices.size(), 1.0F);
  }
  for (float& value : places) value = static_cast<float>(value / open);
  return drawn.spread_shares(std::move(places));
}

/// What the surface shows where its fluence is highest, about.
double brightest(const Look& look) {
  float most = 0.0F;
  for (const auto& fluence : look.light.fluence) most = std::max(most, std::ranges::max(fluence));
  return most / (4.0 * std::numbers::pi * look.ior * look.ior);
}

Box own_bounds(const TriangleMesh& surface, const Pose& scene_from_own) {
  TriangleMesh own;
  const Pose own_from_scene = scene_from_own.inverse();
  for (const Vec3& p : surface.vertices) own.vertices.push_back(own_from_scene.apply(p));
  return bounds(own);
}

/// The ray that goes on inside of light from `towards` (Snell).
Vec3 refracted(Vec3 towards, Vec3 normal, double ior) {
  const double cosine = dot(normal, towards);
  const Vec3 tangent = (normal * cosine - towards) * (1.0 / ior);
  return normalized(tangent - normal * std::sqrt(std::max(0.0, 1.0 - dot(tangent, tangent))));
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
    step(fmt::format("preparing {}", object.name),
         done / static_cast<double>(scene.objects.size()));
    if (auto added = made->add(object, stop); !added) {
      return added.error().in(fmt::format("object \"{}\"", object.name));
    }
    done += 1.0;
  }
  if (auto built = made->surfaces_.build(); !built) return built.error();
  step("visibility of the environment", 1.0);
  if (auto seen = made->look_at_sky(stop); !seen) return seen.error();
  return made;
}

Result<void> SceneRenderer::add(const ObjectOptions& object, std::stop_token stop) {
  return object.kind == ObjectOptions::Kind::kTranslucent ? add_translucent(object, stop)
                                                          : add_opaque(object, stop);
}

Result<void> SceneRenderer::add_translucent(const ObjectOptions& object, std::stop_token stop) {
  auto body =
      TranslucentBody::create(object, scene_.diffusion, scene_.picture.refinement, team_, stop);
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
  bodies_.push_back({*std::move(body), number});
  opaque_.emplace_back();
  return ok();
}

Result<void> SceneRenderer::add_opaque(const ObjectOptions& object, std::stop_token stop) {
  const Stopwatch watch(statistics_.load_seconds);
  auto shape = load_opaque(object.shape, kOpaqueTetrahedra, stop);
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
  const double across = std::cbrt(report.volume_mm3);
  if (across < kFewFreePaths * report.shortest_free_path) {
    statistics_.notes.push_back(fmt::format(
        "{}: only {:.2g} transport mean free paths across: diffusion is a poor model of it",
        object.name,
        across / report.shortest_free_path));
  }
}

Result<void> SceneRenderer::look_at_sky(std::stop_token stop) {
  body_sky_.resize(bodies_.size());
  if (is_black(scene_.environment.radiance)) {
    leave_out("environment: it is black");
    for (std::size_t o = 0; o < opaque_.size(); ++o) {
      if (opaque_[o].drawn) {
        looks_[o].sky.assign(opaque_[o].drawn->mesh().vertices.size(), 0.0F);
      }
    }
    return ok();
  }
  const Stopwatch watch(statistics_.setup_seconds);
  const bool hidden = scene_.environment.rays > 0;
  if (!hidden) leave_out("environment: nothing hides it (rays = 0)");
  const auto directions = cosine_directions(hidden ? scene_.environment.rays : 256);
  const auto share = [&](const SurfacePlace& place, const auto& weight) {
    if (hidden) return surfaces_.sky(place, directions, weight);
    double sum = 0.0;
    for (const Vec3& d : directions) sum += weight(d.z);
    return sum / static_cast<double>(directions.size());
  };
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    const auto& places = bodies_[b].body->subsurface().places();
    const double ior = looks_[bodies_[b].object].ior;
    body_sky_[b].resize(places.size());
    const auto passed = [ior](double cosine) { return 1.0 - fresnel_reflectance(cosine, ior); };
    for_each(places.size(), team_, stop, [&](std::size_t i) {
      body_sky_[b][i] = static_cast<float>(std::numbers::pi * share(places[i], passed));
    });
    double open = 0.0;
    for (const Vec3& d : directions) open += passed(d.z);
    open *= std::numbers::pi / static_cast<double>(directions.size());
    looks_[bodies_[b].object].sky = sky_share(bodies_[b].body->drawn(), body_sky_[b], open);
  }
  for (std::size_t o = 0; o < opaque_.size(); ++o) {
    if (!opaque_[o].drawn) continue;
    const TriangleMesh& mesh = opaque_[o].drawn->mesh();
    const Vec3 size = surfaces_.bounds().size();
    const double small = 1e-4 * std::max({size.x, size.y, size.z});
    looks_[o].sky.resize(mesh.vertices.size());
    for_each(mesh.vertices.size(), team_, stop, [&](std::size_t v) {
      const SurfacePlace place{mesh.vertices[v], opaque_[o].drawn->normals()[v], small};
      looks_[o].sky[v] = length(place.normal) > 0.0
                             ? static_cast<float>(share(place, [](double) { return 1.0; }))
                             : 0.0F;
    });
  }
  if (stop.stop_requested()) return cancelled("looking for what hides the environment");
  return ok();
}

/// Light from a lamp on a place: W/mm^2 that passes the surface; black where it does not reach.
Colour SceneRenderer::passed(const LightOptions& light,
                             const LightSample& from,
                             const SurfacePlace& place,
                             double ior) const {
  const double cosine = dot(place.normal, from.towards);
  if (!(cosine > 0.0) || is_black(from.irradiance)) return {};
  if (light.shadows && surfaces_.hides(place, from.towards, from.distance)) return {};
  const double share = cosine * (1.0 - fresnel_reflectance(std::min(1.0, cosine), ior));
  Colour q{};
  for (int c = 0; c < 3; ++c) q[c] = share * from.irradiance[c];
  return q;
}

void SceneRenderer::let_in(const Body& body, Entering& light, std::stop_token stop) {
  const auto& places = body.body->subsurface().places();
  const double ior = looks_[body.object].ior;
  std::vector<std::atomic<bool>> reaches(sources_.size());
  for_each(places.size(), team_, stop, [&](std::size_t i) {
    for (std::size_t l = 0; l < sources_.size(); ++l) {
      const Colour q = passed(sources_[l], sample(sources_[l], places[i].place), places[i], ior);
      if (!is_black(q)) reaches[l] = true;
      for (int c = 0; c < 3; ++c) light.q[i][c] += static_cast<float>(q[c]);
    }
  });
  for (std::size_t l = 0; l < sources_.size(); ++l) {
    if (reaches[l]) light_reaches_[l] = true;
  }
}

void SceneRenderer::send_beams(const Body& body, Entering& light, std::stop_token stop) {
  const auto& faces = body.body->subsurface().beams()->faces();
  const double ior = looks_[body.object].ior;
  for (std::size_t l = 0; l < sources_.size(); ++l) {
    std::vector<Beam> beams(faces.size());
    for_each(faces.size(), team_, stop, [&](std::size_t f) {
      const LightSample from = sample(sources_[l], faces[f].middle.place);
      const Colour q = passed(sources_[l], from, faces[f].middle, ior);
      if (is_black(q)) return;
      beams[f] = {static_cast<int>(f), refracted(from.towards, faces[f].middle.normal, ior), q};
      for (double& watts : beams[f].power) watts *= faces[f].area;
    });
    std::erase_if(beams, [](const Beam& beam) { return is_black(beam.power); });
    if (!beams.empty()) light_reaches_[l] = true;
    light.beams.insert(light.beams.end(), beams.begin(), beams.end());
  }
}

SceneRenderer::Entering SceneRenderer::entering(const Body& body, std::stop_token stop) {
  const auto& sky = body_sky_[&body - bodies_.data()];
  Entering light;
  light.q.resize(body.body->subsurface().places().size());
  for (std::size_t i = 0; i < sky.size(); ++i) {
    for (int c = 0; c < 3; ++c) {
      light.q[i][c] = static_cast<float>(sky[i] * scene_.environment.radiance[c]);
    }
  }
  if (scene_.diffusion.entry == Entry::kCollimated && body.body->subsurface().beams() != nullptr) {
    send_beams(body, light, stop);
  } else {
    let_in(body, light, stop);
  }
  return light;
}

Result<void> SceneRenderer::light(const std::vector<LightOptions>& lights, std::stop_token stop) {
  lights_ = lights;
  sources_.clear();
  for (const LightOptions& light : lights) {
    for (LightOptions& part : parts_of(light)) sources_.push_back(std::move(part));
  }
  light_reaches_.assign(sources_.size(), false);
  statistics_.light_seconds = statistics_.solve_seconds = 0.0;
  for (const Body& body : bodies_) {
    Entering light;
    {
      const Stopwatch watch(statistics_.light_seconds);
      light = entering(body, stop);
      if (stop.stop_requested()) return cancelled("lighting");
    }
    const Stopwatch watch(statistics_.solve_seconds);
    const auto solved = body.body->subsurface().light(light.q, light.beams, stop);
    SceneStatistics::Object& object = statistics_.objects[body.object];
    if (!solved) return solved.error().in(fmt::format("object \"{}\"", object.name));
    object.iterations = solved->iterations;
    object.relative_residual = solved->relative_residual;
    looks_[body.object].light = body.body->drawn().spread(body.body->subsurface().lit());
    looks_[body.object].mark_radiance = brightest(looks_[body.object]);
  }
  leave_out_dark();
  return ok();
}

void SceneRenderer::leave_out(std::string what) {
  auto& list = statistics_.left_out;
  if (std::ranges::find(list, what) == list.end()) list.push_back(std::move(what));
}

void SceneRenderer::leave_out_dark() {
  const bool only_bodies =
      std::ranges::none_of(opaque_, [](const Opaque& o) { return o.drawn != nullptr; });
  for (const LightOptions& light : lights_) {
    bool reaches = !only_bodies;
    for (std::size_t k = 0; k < sources_.size(); ++k) {
      reaches = reaches || (light_reaches_[k] && sources_[k].name == light.name);
    }
    if (!reaches) leave_out(fmt::format("{}: it reaches no object", light.name));
  }
  for (std::size_t o = 0; o < looks_.size(); ++o) {
    if (looks_[o].surface.specular != SpecularModel::kNone && looks_[o].ior == 1.0) {
      leave_out(
          fmt::format("specular of {}: nothing is mirrored at ior 1", statistics_.objects[o].name));
    }
  }
}

Result<Image<float>> SceneRenderer::draw(const CameraModel& camera, std::stop_token stop) {
  statistics_.draw_seconds = 0.0;
  const Stopwatch watch(statistics_.draw_seconds);
  const Painter painter(surfaces_, looks_, sources_, scene_.environment);
  return painter.draw(camera, scene_.picture.samples_per_axis, team_, stop);
}

}  // namespace opaline::render
