#version 450
#extension GL_GOOGLE_include_directive : require
// What the first sweep leaves in red cells, kept in z's red cells, which nobody needs any more:
//
//   z_i := (r - K z)_i = sum_n g_in z_n, over black neighbours  (diffusion/passes.h, smooth_restrict)
//
// set 0: 0 low, 1 high (read), 2 z (read black, write red)
// Size: one thread a red cell, 128 along x as in forward_black.comp.
#include "grid.glsl"
layout(std430, binding = 0) readonly buffer Low { vec4 low[]; };
layout(std430, binding = 1) readonly buffer High { vec4 high[]; };
layout(std430, binding = 2) buffer Z { vec4 z[]; };

vec4 black(int n) { return z[group_offset() + n]; }

void main() {
  const ivec3 c = colored_cell();
  if (c.x < 0) return;
  const int at = index_of(c);
  const Neighbours n = neighbours_of(c, at);
  z[group_offset() + at] = NEIGHBOUR_SUM(black, n, low[at], high[at]);
}
