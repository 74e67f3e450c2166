#version 450
#extension GL_GOOGLE_include_directive : require
// Products of a pair (s, y) and of g~ with another pair (s', y'): s.s', s.y', y.s', y.y', g~.s', g~.y', six slots.
//
// set 0: 0 x, 1 g, 2 s, 3 y, 4 s', 5 y' (read), 6 sums
// Size: kSumGroups workgroups over the parameters.
#define SUMS_BINDING 6
#include "vectors.glsl"
#include "sums.glsl"
layout(std430, binding = 0) readonly buffer X { float x[]; };
layout(std430, binding = 1) readonly buffer G { float g[]; };
layout(std430, binding = 2) readonly buffer S { float s[]; };
layout(std430, binding = 3) readonly buffer Y { float y[]; };
layout(std430, binding = 4) readonly buffer OtherS { float other_s[]; };
layout(std430, binding = 5) readonly buffer OtherY { float other_y[]; };

void main() {
  vec2 sum[6] = vec2[6](vec2(0), vec2(0), vec2(0), vec2(0), vec2(0), vec2(0));
  for (int i = int(gl_GlobalInvocationID.x); i < push.size.x; i += kSumThreads) {
    const vec3 own = vec3(s[i], y[i], free_part(i, x[i], g[i]));
    for (int k = 0; k < 3; ++k) {
      sum[2 * k] = add_to(sum[2 * k], own[k] * other_s[i]);
      sum[2 * k + 1] = add_to(sum[2 * k + 1], own[k] * other_y[i]);
    }
  }
  for (int k = 0; k < 6; ++k) store_sum(push.size.w + k, sum[k], true);
}
