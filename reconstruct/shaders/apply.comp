#version 450
#extension GL_GOOGLE_include_directive : require
// q = K p, and each workgroup's share of gamma = p . q:
//
//   q_i = c_i p_i + sum_n g_in (p_i - p_n),  c = D - sum g      (diffusion/passes.h, apply_dot)
//
// set 0: 0 low, 1 high, 2 p (read), 3 q, 4 partial sums (write)
// Size: one thread a cell, 128 along x; 128 vec4 (2 KiB) of shared memory for the sum.
#define PARTIAL_BINDING 4
#include "grid.glsl"
#include "partial_sum.glsl"
layout(std430, binding = 0) readonly buffer Low { vec4 low[]; };
layout(std430, binding = 1) readonly buffer High { vec4 high[]; };
layout(std430, binding = 2) readonly buffer P { vec4 p[]; };
layout(std430, binding = 3) writeonly buffer Q { vec4 q[]; };

vec4 own;
vec4 rise(int n) { return own - p[group_offset() + n]; }

void main() {
  const ivec3 c = any_cell();
  vec4 product = vec4(0);
  if (c.x >= 0) {
    const int at = index_of(c);
    const Neighbours n = neighbours_of(c, at);
    own = p[group_offset() + at];
    const vec4 value = high[at].w * own + NEIGHBOUR_SUM(rise, n, low[at], high[at]);
    q[group_offset() + at] = value;
    product = own * value;
  }
  store_partial_sum(product, 0);
}
