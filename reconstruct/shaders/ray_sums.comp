#version 450
#extension GL_GOOGLE_include_directive : require
// sum r v_n of each ray's layers, v_0 first, and sum r (phi - S) after the last, over the illuminations.
//                                                              (reconstruct/diffusion/camera_rays.h, add_gradient)
// set 0: 0 the surface's shares, 1 first cells, 2 shares in them, 3 q of the lit face, 4 r, 5 phi, 6 its low part (read),
//        7 sums (read and write)
// Size: one thread a pixel, 128 along the seen face, over all groups.
#include "model.glsl"
layout(std430, binding = 0) readonly buffer Surface { vec4 surface[]; };
layout(std430, binding = 1) readonly buffer TapCells { int tap_cell[]; };
layout(std430, binding = 2) readonly buffer TapShares { vec2 tap_share[]; };
layout(std430, binding = 3) readonly buffer Irradiance { vec4 irradiance[]; };
layout(std430, binding = 4) readonly buffer Rims { vec4 rim[]; };
layout(std430, binding = 5) readonly buffer High { vec4 phi[]; };
layout(std430, binding = 6) readonly buffer Low { vec4 phi_low[]; };
layout(std430, binding = 7) buffer Sums { float sums[]; };
#include "camera_path.glsl"

void add(int row, int f, float value) {
  const int at = row * face_count() + f;
  sums[at] = (has(kFirst) ? 0.0 : sums[at]) + value;
}

void main() {
  const int f = int(gl_GlobalInvocationID.x);
  if (f >= face_count()) return;
  float of_surface = 0.0;
  float over_source = 0.0;
  for (int group = 0; group < push.face.y; ++group) {
    const int n = group * face_count() + f;
    const int own = group * push.cells.w + cell_behind(f);
    vec4 source = vec4(0);
    if (has(kLit) && !has(kCollimated)) source = push.surface.y * irradiance[n];
    const float rise = dot(rim[n], (phi[own] - source) + phi_low[own]);
    over_source += rise;
    of_surface += dot(rim[n], source) + surface[f].y * rise;
  }
  add(0, f, of_surface);
  add(push.cells[face_axis()] + 1, f, over_source);
  for (int layer = 0; layer < int(surface[f].w); ++layer) {
    const int s = layer * face_count() + f;
    float sum = 0.0;
    for (int group = 0; group < push.face.y; ++group) {
      const int first = group * push.cells.w + tap_cell[s];
      vec4 v = vec4(0);
      for (int j = 0; j < 4; ++j)
        v += weight_of(tap_share[s], j) * (phi[first + corner_of(j)] + phi_low[first + corner_of(j)]);
      sum += dot(rim[group * face_count() + f], v);
    }
    add(layer + 1, f, sum);
  }
}
