#pragma once

#include <stop_token>

#include "base/camera_model.h"
#include "base/image.h"
#include "base/thread_team.h"
#include "render/graph/optics.h"
#include "render/mesh/triangle_mesh.h"

namespace opaline::render {

/// Values of triangles (a QuadGraph's surface nodes) as values of the vertices: the average over the triangles around each,
/// weighted by area. 0 where a vertex has no triangle. Needs a valid mesh, and as many values as it has triangles.
SurfaceLight at_vertices(const TriangleMesh& surface, const SurfaceLight& of_triangles);

/// The normals of the vertices: the sum of the triangles around each, weighted by area; 0 where that cancels.
std::vector<Vec3> vertex_normals(const TriangleMesh& surface);

struct PictureOptions {
  double ior = 1.3;          ///< of the medium, 1 to 3
  int samples_per_axis = 1;  ///< rays of a pixel: 1 to 16, squared
};

/// What a camera sees of a translucent object, one ray a sample:
///
///   L = F_t(mu_o) / (4 pi ior^2) (phi + 3 mu_i J_n)     (docs/physics.md, "Radiance towards a camera")
///
/// phi, J_n and the normal interpolated between the vertices of the triangle that the ray meets first; never below 0.
/// Answers height x width x 4, W/(mm^2 sr): red, green, blue averaged over the samples, and the share that met the object.
///
/// Errors: kInvalidArgument for a mesh or options that are out of range, or light of another shape; kCancelled.
Result<Image<float>> draw_surface(const TriangleMesh& surface,
                                  const SurfaceLight& at_vertices,
                                  const CameraModel& camera,
                                  const PictureOptions& options,
                                  ThreadTeam& team,
                                  std::stop_token stop);

}  // namespace opaline::render
