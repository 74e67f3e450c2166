// How light enters a scene's objects: what of SceneRenderer looks at lamps and at the environment.

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numbers>

#include "reconstruct/diffusion/fresnel.h"
#include "render/scene/scene_renderer.h"
#include "render/scene/team_work.h"

namespace opaline::render {
namespace {

using reconstruct::diffusion::fresnel_reflectance;

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

}  // namespace

Result<void> SceneRenderer::look_at_sky(std::stop_token stop) {
  static std::atomic<std::uint64_t> shapes{0};
  shape_ = ++shapes;
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
  const SpentTime watch(statistics_.setup_seconds);
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
    const auto& edges = bodies_[b].body->subsurface().edges();
    const std::size_t middles = bodies_[b].body->subsurface().surface().vertices.size();
    std::vector<float>& sky = body_sky_[b];
    sky.resize(places.size());
    const auto passed = [ior](double cosine) { return 1.0 - fresnel_reflectance(cosine, ior); };
    for_each(sky.size(), team_, stop, [&](std::size_t i) {
      if (i >= middles && i < middles + edges.size()) return;
      sky[i] = static_cast<float>(std::numbers::pi * share(places[i], passed));
    });
    for (std::size_t e = 0; e < edges.size();
         ++e)  // the sky changes slowly, and is dear to look at
      sky[middles + e] = 0.5F * (sky[edges[e][0]] + sky[edges[e][1]]);
    double open = 0.0;
    for (const Vec3& d : directions) open += passed(d.z);
    open *= std::numbers::pi / static_cast<double>(directions.size());
    const auto known = edges.empty() ? sky.end() : sky.begin() + static_cast<long>(middles);
    looks_[bodies_[b].object].sky = sky_share(bodies_[b].body->drawn(), {sky.begin(), known}, open);
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
  light.lamps.resize(places.size());
  for_each(places.size(), team_, stop, [&](std::size_t i) {
    for (std::size_t l = 0; l < sources_.size(); ++l) {
      const Colour q = passed(sources_[l], sample(sources_[l], places[i].place), places[i], ior);
      if (!is_black(q)) reaches[l] = true;
      for (int c = 0; c < 3; ++c) light.lamps[i][c] += static_cast<float>(q[c]);
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
  light.environment.resize(body.body->subsurface().places().size());
  for (std::size_t i = 0; i < sky.size(); ++i) {
    for (int c = 0; c < 3; ++c) {
      light.environment[i][c] = static_cast<float>(sky[i] * scene_.environment.radiance[c]);
    }
  }
  if (scene_.diffusion.entry == Entry::kCollimated && body.body->subsurface().beams() != nullptr) {
    send_beams(body, light, stop);
  } else {
    let_in(body, light, stop);
  }
  return light;
}

bool SceneRenderer::is_provisional() const {
  return std::ranges::any_of(bodies_,
                             [](const Body& b) { return b.body->subsurface().is_provisional(); });
}

Result<void> SceneRenderer::light(const std::vector<LightOptions>& lights,
                                  Pace pace,
                                  std::stop_token stop) {
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
      const SpentTime watch(statistics_.light_seconds);
      light = entering(body, stop);
      if (stop.stop_requested()) return cancelled("lighting");
    }
    const SpentTime watch(statistics_.solve_seconds);
    Subsurface& solid = body.body->subsurface();
    const auto solved = solid.light({light.environment, light.lamps, pace}, light.beams, stop);
    SceneStatistics::Object& object = statistics_.objects[body.object];
    if (!solved) return solved.error().in(fmt::format("object \"{}\"", object.name));
    object.iterations = solved->iterations;
    object.relative_residual = solved->relative_residual;
    object.environment = solid.environment_entry();
    object.lamps = solid.lamps_entry();
    looks_[body.object].light = body.body->drawn().spread(solid.lit());
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

}  // namespace opaline::render
