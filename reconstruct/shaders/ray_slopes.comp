#version 450
#extension GL_GOOGLE_include_directive : require
// The derivatives of sum r Phi by each layer's t and alpha' (reconstruct/diffusion/camera_rays.h, slopes); t's times the
// layer's length over 3. The surface's by kappa takes the place of the last sum.
//
// set 0: 0 t, alpha', D, E; 1 b, db/dt, share; 2 the surface's shares, 3 length of a layer (read), 4 sums (read and write),
//        5 slopes (write)
// Size: one thread a pixel, 128 along the seen face.
#include "model.glsl"
layout(std430, binding = 0) readonly buffer Losses { vec4 losses[]; };
layout(std430, binding = 1) readonly buffer Shares { vec4 shares[]; };
layout(std430, binding = 2) readonly buffer Surface { vec4 surface[]; };
layout(std430, binding = 3) readonly buffer Lengths { float layer_length[]; };
layout(std430, binding = 4) buffer Sums { float sums[]; };
layout(std430, binding = 5) writeonly buffer Slopes { vec2 slopes[]; };

void main() {
  const int f = int(gl_GlobalInvocationID.x);
  if (f >= face_count()) return;
  const int layers = push.cells[face_axis()];
  const int last = int(surface[f].w) - 1;
  const float length = layer_length[f] / 3.0;
  const vec4 end = losses[last * face_count() + f];
  float after = sums[(last + 1) * face_count() + f];  // v_n, from the end
  const float step = after - sums[last * face_count() + f];
  const float twice = last == 0 ? 2.0 : 1.0;
  const float tail = end.w * (after + twice * (0.5 + 1.0 / end.x) * step);
  float beyond = end.y * tail;
  for (int n = layers - 1; n > last; --n) slopes[n * face_count() + f] = vec2(0);
  for (int n = last; n >= 0; --n) {
    const int s = n * face_count() + f;
    const vec4 l = losses[s];
    const float before = sums[s];
    const float seen = after + shares[s].x * (before - after);
    vec2 by = vec2(l.y * (l.w * seen + l.z * (before - after) * shares[s].y) - beyond, l.z * seen);
    beyond += l.y * l.z * seen;
    if (n == last) by += vec2(-end.y * end.w * step * twice / (end.x * end.x), tail);
    slopes[s] = vec2(length * by.x, by.y);
    after = before;
  }
  sums[(layers + 1) * face_count() + f] *= surface[f].x * surface[f].z;
}
