#version 450
#extension GL_GOOGLE_include_directive : require
// Surfaces of all objects as seen by a pinhole camera, their vertices pulled from buffers.
//   set 0: 0 scene (fragments), 1 objects, 2 vertices, 3 their light, 4 shadow maps (fragments)
#include "raster.glsl"
layout(std430, set = 0, binding = 1) readonly buffer Objects { Object objects[]; };
layout(std430, set = 0, binding = 2) readonly buffer Vertices { Vertex vertices[]; };
layout(std430, set = 0, binding = 3) readonly buffer Lit { Glow glow[]; };
layout(push_constant) uniform View { vec4 clip_from_scene[4]; };  // rows; depth runs from 1 near to 0 far
layout(location = 0) out vec3 place;
layout(location = 1) out vec3 normal;
layout(location = 2) out vec3 fluence;
layout(location = 3) out vec3 flux;
layout(location = 4) out vec2 sky_mark;
layout(location = 5) flat out vec4 optics;
layout(location = 6) out vec4 matte;  // w: radiance of marks

void main() {
  const Vertex v = vertices[gl_VertexIndex];
  const Glow g = glow[gl_VertexIndex];
  const Object object = objects[int(v.place.w)];
  optics = object.optics;
  matte = vec4(v.matte.rgb, object.marks.w);
  place = v.place.xyz;
  normal = v.normal.xyz;
  fluence = vec3(g.fluence[0], g.fluence[1], g.fluence[2]);
  flux = vec3(g.flux[0], g.flux[1], g.flux[2]);
  sky_mark = vec2(v.normal.w, g.mark);
  const vec4 p = vec4(place, 1.0);
  gl_Position = vec4(dot(clip_from_scene[0], p), dot(clip_from_scene[1], p), dot(clip_from_scene[2], p),
                     dot(clip_from_scene[3], p));
}
