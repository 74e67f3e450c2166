#version 450
#extension GL_GOOGLE_include_directive : require
// The curvature pair of an attempt, s = x' - x and y = g' - g, and the scalars of the line search (sums: slots.glsl).
//
// set 0: 0 x, 1 g, 2 d, 3 x', 4 g' (read), 5 s, 6 y (write), 7 sums
// Size: kSumGroups workgroups over the parameters.
#define SUMS_BINDING 7
#include "vectors.glsl"
#include "sums.glsl"
#include "slots.glsl"
layout(std430, binding = 0) readonly buffer X { float x[]; };
layout(std430, binding = 1) readonly buffer G { float g[]; };
layout(std430, binding = 2) readonly buffer D { float d[]; };
layout(std430, binding = 3) readonly buffer NewX { float new_x[]; };
layout(std430, binding = 4) readonly buffer NewG { float new_g[]; };
layout(std430, binding = 5) writeonly buffer S { float s[]; };
layout(std430, binding = 6) writeonly buffer Y { float y[]; };

void main() {
  vec2 promised = vec2(0);
  vec2 slope = vec2(0);
  vec2 new_slope = vec2(0);
  vec2 square = vec2(0);
  float largest = 0.0;
  for (int i = int(gl_GlobalInvocationID.x); i < push.size.x; i += kSumThreads) {
    const float step = new_x[i] - x[i];
    s[i] = step;
    y[i] = new_g[i] - g[i];
    const float free = free_part(i, new_x[i], new_g[i]);
    promised = add_to(promised, g[i] * step);
    slope = add_to(slope, g[i] * d[i]);
    new_slope = add_to(new_slope, new_g[i] * d[i]);
    square = add_to(square, free * free);
    largest = max(largest, abs(free));
  }
  store_sum(kPromised, promised, true);
  store_sum(kSlope, slope, true);
  store_sum(kNewSlope, new_slope, true);
  store_sum(kSquare, square, true);
  store_largest(kLargest, largest);
}
