#version 450
#extension GL_GOOGLE_include_directive : require
// The faces of the block that look at the camera, as segments x segments squares of two triangles, each vertex through
// the distorted lens. Faces reach out by 1 % on every side: the triangles only say where to look, the fragment shader
// finds the edge.   set 0: 0 scene (read)
#include "scene.glsl"
layout(location = 0) flat out int face;
layout(location = 1) noperspective out vec2 undistorted;  // where the fragment shader starts to look

const float kMargin = 0.01;

void main() {
  const int n = scene.cells.w;
  const int square = gl_VertexIndex / 6 % (n * n);
  face = scene.visible[gl_VertexIndex / (6 * n * n)];
  const ivec2 corner = ivec2[](ivec2(0, 0), ivec2(1, 0), ivec2(0, 1), ivec2(0, 1), ivec2(1, 0),
                               ivec2(1, 1))[gl_VertexIndex % 6];
  const vec2 along = vec2(ivec2(square % n, square / n) + corner) / n * (1.0 + 2.0 * kMargin) - kMargin;
  const FacePlane plane = plane_of(face);
  vec4 point = vec4(0, 0, 0, 1);
  point[plane.axis] = plane.at;
  point[plane.u] = along.x * scene.cells[plane.u] * scene.spacing[plane.u];
  point[plane.v] = along.y * scene.cells[plane.v] * scene.spacing[plane.v];
  const vec3 p = vec3(dot(scene.camera_from_sample[0], point), dot(scene.camera_from_sample[1], point),
                      dot(scene.camera_from_sample[2], point));
  undistorted = p.xy / p.z;
  const vec2 pixel = scene.focal.xy * distort(undistorted) + scene.focal.zw;
  const vec2 in_tile = pixel * scene.optics.w - vec2(tile.origin);
  // 1 / depth is linear on the screen, so no perspective division is left to the device.
  gl_Position = vec4(2.0 * in_tile / vec2(tile.size) - 1.0, scene.optics.z / p.z, 1.0);
}
