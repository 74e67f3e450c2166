#version 450
#extension GL_GOOGLE_include_directive : require
// Surfaces of all objects as seen by a pinhole camera, three vertices a triangle, pulled from buffers. A triangle more than 45
// degrees off a vertex's normal is flat, as in render/scene/surfaces.cc.
//   set 0: 0 scene, 1 objects (fragments), 2 vertices, 3 triangles (a, b, c, object), 4 to 7 shadow maps (fragments)
#include "raster.glsl"
layout(std430, set = 0, binding = 2) readonly buffer Vertices { Vertex vertices[]; };
layout(std430, set = 0, binding = 3) readonly buffer Triangles { ivec4 triangles[]; };
layout(push_constant) uniform View { vec4 clip_from_scene[4]; };  // rows; depth runs from 1 near to 0 far
layout(location = 0) out vec3 place;
layout(location = 1) out vec3 normal;
layout(location = 2) out vec3 fluence;
layout(location = 3) out vec3 flux;
layout(location = 4) out vec2 sky_mark;
layout(location = 5) flat out vec3 facet;
layout(location = 6) flat out int object;

const float kCrease = 0.707;

void main() {
  const ivec4 t = triangles[gl_VertexIndex / 3];
  const Vertex v = vertices[t[gl_VertexIndex % 3]];
  const vec3 a = vertices[t.x].place.xyz;
  facet = normalize(cross(vertices[t.y].place.xyz - a, vertices[t.z].place.xyz - a));
  const float flattest = min(min(dot(facet, vertices[t.x].normal.xyz), dot(facet, vertices[t.y].normal.xyz)),
                             dot(facet, vertices[t.z].normal.xyz));
  object = t.w;
  place = v.place.xyz;
  normal = flattest > kCrease ? v.normal.xyz : facet;
  fluence = v.fluence.rgb;
  flux = v.flux.rgb;
  sky_mark = vec2(v.place.w, v.normal.w);
  const vec4 p = vec4(place, 1.0);
  gl_Position = vec4(dot(clip_from_scene[0], p), dot(clip_from_scene[1], p), dot(clip_from_scene[2], p),
                     dot(clip_from_scene[3], p));
}
