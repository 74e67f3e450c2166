#include "render/trace/surface_picture.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numbers>

#include "reconstruct/diffusion/fresnel.h"
#include "render/trace/triangle_tree.h"

namespace opaline::render {
namespace {

using reconstruct::diffusion::fresnel_reflectance;
using reconstruct::diffusion::refracted_cosine;
using Colour = std::array<double, 3>;

Vec3 area_vector(const TriangleMesh& mesh, const std::array<int, 3>& t) {
  const Vec3 a = mesh.vertices[t[0]];
  return cross(mesh.vertices[t[1]] - a, mesh.vertices[t[2]] - a) * 0.5;
}

std::vector<std::array<float, 3>> averaged(const TriangleMesh& mesh,
                                           const std::vector<std::array<float, 3>>& values) {
  std::vector<Colour> sums(mesh.vertices.size());
  std::vector<double> areas(mesh.vertices.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const double area = length(area_vector(mesh, mesh.triangles[t]));
    for (const int v : mesh.triangles[t]) {
      areas[v] += area;
      for (int c = 0; c < 3; ++c) sums[v][c] += area * values[t][c];
    }
  }
  std::vector<std::array<float, 3>> means(sums.size());
  for (std::size_t v = 0; v < sums.size(); ++v) {
    if (areas[v] == 0.0) continue;
    for (int c = 0; c < 3; ++c) means[v][c] = static_cast<float>(sums[v][c] / areas[v]);
  }
  return means;
}

class Painter {
 public:
  Painter(const TriangleMesh& mesh,
          const SurfaceLight& light,
          const CameraModel& camera,
          const PictureOptions& options,
          const TriangleTree& tree)
      : mesh_(mesh),
        light_(light),
        camera_(camera),
        options_(options),
        tree_(tree),
        normals_(vertex_normals(mesh)),
        centre_(camera.centre()) {}

  void draw_row(Image<float>& picture, int y) const {
    for (int x = 0; x < picture.width(); ++x) draw_pixel(picture, x, y);
  }

 private:
  void draw_pixel(Image<float>& picture, int x, int y) const {
    const int s = options_.samples_per_axis;
    std::array<double, 4> sum{};
    for (int k = 0; k < s * s; ++k) {
      const int row = k / s;
      const Ray ray{
          centre_, normalized(camera_.ray_direction({x + (k % s + 0.5) / s, y + (row + 0.5) / s}))};
      const auto hit = tree_.nearest(ray);
      if (!hit) continue;
      const Colour colour = radiance(ray, *hit);
      for (int c = 0; c < 3; ++c) sum[c] += colour[c];
      sum[3] += 1.0;
    }
    for (int c = 0; c < 4; ++c) picture.at(x, y, c) = static_cast<float>(sum[c] / (s * s));
  }

  Colour radiance(const Ray& ray, const RayHit& hit) const {
    const auto& corners = mesh_.triangles[hit.triangle];
    Vec3 normal;
    Colour fluence{};
    Colour flux{};
    for (int k = 0; k < 3; ++k) {
      normal = normal + normals_[corners[k]] * hit.weights[k];
      for (int c = 0; c < 3; ++c) {
        fluence[c] += hit.weights[k] * light_.fluence[corners[k]][c];
        flux[c] += hit.weights[k] * light_.net_flux[corners[k]][c];
      }
    }
    const double size = length(normal);
    const double mu = size > 0.0 ? std::clamp(-dot(ray.direction, normal) / size, 0.0, 1.0) : 0.0;
    return outgoing(mu, fluence, flux);
  }

  Colour outgoing(double mu, const Colour& fluence, const Colour& flux) const {
    const double ior = options_.ior;
    const double scale =
        (1.0 - fresnel_reflectance(mu, ior)) / (4.0 * std::numbers::pi * ior * ior);
    Colour colour{};
    for (int c = 0; c < 3; ++c) {
      colour[c] = scale * std::max(0.0, fluence[c] + 3.0 * refracted_cosine(mu, ior) * flux[c]);
    }
    return colour;
  }

  const TriangleMesh& mesh_;
  const SurfaceLight& light_;
  const CameraModel& camera_;
  const PictureOptions& options_;
  const TriangleTree& tree_;
  std::vector<Vec3> normals_;
  Vec3 centre_;
};

Result<void> check(const TriangleMesh& surface,
                   const SurfaceLight& light,
                   const CameraModel& camera,
                   const PictureOptions& options) {
  const auto refuse = [](const char* why) { return invalid_argument(why); };
  if (!(options.ior >= 1.0 && options.ior <= 3.0)) return refuse("ior must be within 1 to 3");
  if (options.samples_per_axis < 1 || options.samples_per_axis > 16) {
    return refuse("samples per axis must be within 1 to 16");
  }
  if (camera.width < 1 || camera.height < 1) return refuse("the camera has no pixels");
  if (light.fluence.size() != surface.vertices.size() ||
      light.net_flux.size() != surface.vertices.size()) {
    return refuse("light needs one value a vertex of the surface");
  }
  return ok();
}

}  // namespace

SurfaceLight at_vertices(const TriangleMesh& surface, const SurfaceLight& of_triangles) {
  return {averaged(surface, of_triangles.fluence), averaged(surface, of_triangles.net_flux)};
}

std::vector<Vec3> vertex_normals(const TriangleMesh& surface) {
  std::vector<Vec3> normals(surface.vertices.size());
  for (const auto& triangle : surface.triangles) {
    const Vec3 area = area_vector(surface, triangle);
    for (const int v : triangle) normals[v] = normals[v] + area;
  }
  for (Vec3& normal : normals) {
    if (length(normal) > 0.0) normal = normalized(normal);
  }
  return normals;
}

Result<Image<float>> draw_surface(const TriangleMesh& surface,
                                  const SurfaceLight& at_vertices,
                                  const CameraModel& camera,
                                  const PictureOptions& options,
                                  ThreadTeam& team,
                                  std::stop_token stop) {
  const auto tree = TriangleTree::create(surface);
  if (!tree) return tree.error();
  if (auto good = check(surface, at_vertices, camera, options); !good) return good.error();
  const Painter painter(surface, at_vertices, camera, options, *tree);
  Image<float> picture(camera.width, camera.height, 4);
  std::atomic<int> next{0};
  team.run([&](int) {
    for (int y = next++; y < camera.height && !stop.stop_requested(); y = next++) {
      painter.draw_row(picture, y);
    }
  });
  if (stop.stop_requested()) return Error{ErrorCode::kCancelled, "the picture was cancelled"};
  return picture;
}

}  // namespace opaline::render
