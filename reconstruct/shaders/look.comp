#version 450
#extension GL_GOOGLE_include_directive : require
// Phi, what each ray sees of four illuminations (reconstruct/diffusion/camera_rays.h).
//
// set 0: 0 the surface's shares, 1 the layers', 2 first cells, 3 shares in them, 4 q of the lit face, 5 phi, 6 its low
//        part (read), 7 Phi (write)
// Size: one thread a pixel, 128 along the seen face; y counts the groups.
#include "model.glsl"
layout(std430, binding = 0) readonly buffer Surface { vec4 surface[]; };
layout(std430, binding = 1) readonly buffer Shares { vec4 shares[]; };
layout(std430, binding = 2) readonly buffer TapCells { int tap_cell[]; };
layout(std430, binding = 3) readonly buffer TapShares { vec2 tap_share[]; };
layout(std430, binding = 4) readonly buffer Irradiance { vec4 irradiance[]; };
layout(std430, binding = 5) readonly buffer High { vec4 phi[]; };
layout(std430, binding = 6) readonly buffer Low { vec4 phi_low[]; };
layout(std430, binding = 7) writeonly buffer Seen { vec4 seen[]; };
#include "camera_path.glsl"

void main() {
  const int f = int(gl_GlobalInvocationID.x);
  if (f >= face_count()) return;
  const int first = int(gl_GlobalInvocationID.y) * push.cells.w;
  const int n = int(gl_GlobalInvocationID.y) * face_count() + f;
  const int own = first + cell_behind(f);
  vec4 source = vec4(0);
  if (has(kLit) && !has(kCollimated)) source = push.surface.y * irradiance[n];
  vec4 sum = surface[f].x * (source + surface[f].y * ((phi[own] - source) + phi_low[own]));
  for (int layer = 0; layer < int(surface[f].w); ++layer) {
    const int s = layer * face_count() + f;
    vec4 high = vec4(0);
    vec4 low = vec4(0);
    for (int j = 0; j < 4; ++j) {
      const int at = first + tap_cell[s] + corner_of(j);
      const float w = weight_of(tap_share[s], j);
      high += w * phi[at];
      low += w * phi_low[at];
    }
    sum += shares[s].z * (high + low);
  }
  seen[n] = sum;
}
