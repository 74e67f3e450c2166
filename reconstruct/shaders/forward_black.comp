#version 450
#extension GL_GOOGLE_include_directive : require
// First sweep of the V-cycle from z = 0, black cells; the red half-sweep z = r / D is taken on the fly:
//
//   z_i = (r_i + sum_n g_in r_n / D_n) / D_i                    (diffusion/passes.h, smooth_restrict)
//
// set 0: 0 low, 1 high, 2 r (read), 3 z (write black)
// Size: one thread a black cell; 128 in a row because lavapipe is at its best with 64 and more along x.
#include "grid.glsl"
layout(std430, binding = 0) readonly buffer Low { vec4 low[]; };
layout(std430, binding = 1) readonly buffer High { vec4 high[]; };
layout(std430, binding = 2) readonly buffer R { vec4 r[]; };
layout(std430, binding = 3) writeonly buffer Z { vec4 z[]; };

vec4 red(int n) { return r[group_offset() + n] / low[n].w; }

void main() {
  const ivec3 c = colored_cell();
  if (c.x < 0) return;
  const int at = index_of(c);
  const Neighbours n = neighbours_of(c, at);
  const vec4 sum = NEIGHBOUR_SUM(red, n, low[at], high[at]);
  z[group_offset() + at] = (r[group_offset() + at] + sum) / low[at].w;
}
