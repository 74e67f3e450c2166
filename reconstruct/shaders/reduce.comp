#version 450
#extension GL_GOOGLE_include_directive : require
// Adds up the partial sums of each group, in a fixed order, into scalar number ratio.w; rho is first kept as rho_before.
//
// set 0: 0 partial sums (read), 1 scalars (read and write)
// Size: one workgroup of 128 a group: at most a few thousand partial sums.
#include "grid.glsl"
#include "scalars.glsl"
layout(std430, binding = 0) readonly buffer Partials { vec4 partials[]; };
layout(std430, binding = 1) buffer Scalars { vec4 scalars[]; };
shared vec4 workgroup_sum[128];

void main() {
  const int group = int(gl_WorkGroupID.y);
  const uint t = gl_LocalInvocationID.x;
  vec4 sum = vec4(0);
  for (int i = int(t); i < push.partial.y; i += 128) sum += partials[push.partial.x + group * push.partial.y + i];
  workgroup_sum[t] = sum;
  for (uint half_width = 64; half_width > 0; half_width /= 2) {
    barrier();
    if (t < half_width) workgroup_sum[t] += workgroup_sum[t + half_width];
  }
  if (t > 0) return;
  const int groups = push.partial.w;
  if (push.ratio.w == kRho) scalars[kRhoBefore * groups + group] = scalars[kRho * groups + group];
  scalars[push.ratio.w * groups + group] = workgroup_sum[0];
}
