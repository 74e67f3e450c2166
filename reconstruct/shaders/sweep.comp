#version 450
#extension GL_GOOGLE_include_directive : require
// Gauss-Seidel on the cells of one colour, and their share of rho = r . z:
//
//   z_i = (r_i + sum_n g_in z_n) / D_i                          (diffusion/passes.h, prolong_smooth)
//
// set 0: 0 low, 1 high, 2 r (read), 3 z (read the other colour, write this one), 4 partial sums (write)
// Size: one thread a cell of the colour, 128 along x; 128 vec4 (2 KiB) of shared memory for the sum.
#define PARTIAL_BINDING 4
#include "grid.glsl"
#include "partial_sum.glsl"
layout(std430, binding = 0) readonly buffer Low { vec4 low[]; };
layout(std430, binding = 1) readonly buffer High { vec4 high[]; };
layout(std430, binding = 2) readonly buffer R { vec4 r[]; };
layout(std430, binding = 3) buffer Z { vec4 z[]; };

vec4 other(int n) { return z[group_offset() + n]; }

void main() {
  const ivec3 c = colored_cell();
  vec4 product = vec4(0);
  if (c.x >= 0) {
    const int at = index_of(c);
    const Neighbours n = neighbours_of(c, at);
    const vec4 residual = r[group_offset() + at];
    const vec4 value = (residual + NEIGHBOUR_SUM(other, n, low[at], high[at])) / low[at].w;
    z[group_offset() + at] = value;
    product = residual * value;
  }
  store_partial_sum(product, 0);
}
