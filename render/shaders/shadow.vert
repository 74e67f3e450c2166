#version 450
#extension GL_GOOGLE_include_directive : require
// Surfaces as a light sees them.   set 0: 0 vertices, 1 triangles (a, b, c, object)
#include "raster.glsl"
layout(std430, set = 0, binding = 0) readonly buffer Vertices { Vertex vertices[]; };
layout(std430, set = 0, binding = 1) readonly buffer Triangles { ivec4 triangles[]; };
layout(push_constant) uniform View { vec4 clip_from_scene[4]; };  // rows

void main() {
  const vec4 p = vec4(vertices[triangles[gl_VertexIndex / 3][gl_VertexIndex % 3]].place.xyz, 1.0);
  gl_Position = vec4(dot(clip_from_scene[0], p), dot(clip_from_scene[1], p), dot(clip_from_scene[2], p),
                     dot(clip_from_scene[3], p));
}
