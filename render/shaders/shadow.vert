#version 450
#extension GL_GOOGLE_include_directive : require
// Surfaces as a light sees them; depth runs from 1 near to 0 far.   set 0: 0 vertices
#include "raster.glsl"
layout(std430, set = 0, binding = 0) readonly buffer Vertices { Vertex vertices[]; };
layout(push_constant) uniform View { vec4 clip_from_scene[4]; };  // rows

void main() {
  const vec4 p = vec4(vertices[gl_VertexIndex].place.xyz, 1.0);
  gl_Position = vec4(dot(clip_from_scene[0], p), dot(clip_from_scene[1], p), dot(clip_from_scene[2], p),
                     dot(clip_from_scene[3], p));
}
