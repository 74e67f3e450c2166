#version 450
#extension GL_GOOGLE_include_directive : require
// r = b - K x for x = high + low, and each workgroup's share of ||r||^2 and ||b||^2:
//
//   r_i = b_i - c_i x_i - sum_n g_in (x_i - x_n),   c = D - sum g
//
// Differences first: that of two neighbours' high parts is nearly exact, so the residual is rounded at the size of the
// fluxes, not of the fluence.
// set 0: 0 low, 1 high of the matrix, 2 b, 3 high part of x, 4 its low part (read), 5 r, 6 partial sums (write)
// Size: one thread a cell, 128 along x; 128 vec4 (2 KiB) of shared memory for the sums.
#define PARTIAL_BINDING 6
#include "grid.glsl"
#include "partial_sum.glsl"
layout(std430, binding = 0) readonly buffer Low { vec4 low[]; };
layout(std430, binding = 1) readonly buffer High { vec4 high[]; };
layout(std430, binding = 2) readonly buffer B { vec4 b[]; };
layout(std430, binding = 3) readonly buffer X { vec4 x[]; };
layout(std430, binding = 4) readonly buffer XLow { vec4 x_low[]; };
layout(std430, binding = 5) writeonly buffer R { vec4 r[]; };

int own;
vec4 rise(int n) {
  n += group_offset();
  return (x[own] - x[n]) + (x_low[own] - x_low[n]);
}

void main() {
  const ivec3 c = any_cell();
  vec4 square = vec4(0);
  vec4 source = vec4(0);
  if (c.x >= 0) {
    const int at = index_of(c);
    own = group_offset() + at;
    const Neighbours n = neighbours_of(c, at);
    const vec4 value = b[own] - high[at].w * (x[own] + x_low[own]) - NEIGHBOUR_SUM(rise, n, low[at], high[at]);
    r[own] = value;
    square = value * value;
    source = b[own] * b[own];
  }
  store_partial_sum(square, 0);
  store_partial_sum(source, push.partial.w * push.partial.y);
}
