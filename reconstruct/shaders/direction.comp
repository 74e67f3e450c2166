#version 450
#extension GL_GOOGLE_include_directive : require
// The next direction of conjugate gradients, p = z + beta p, beta = rho / rho_before (0 on a restart or where rho_before
// is not positive)                                              (diffusion/passes.h, apply_dot)
//
// set 0: 0 scalars, 1 z (read), 2 p (read and write)
// Size: one thread a cell, 128 along x.
#include "grid.glsl"
#include "scalars.glsl"
layout(std430, binding = 0) readonly buffer Scalars { vec4 scalars[]; };
layout(std430, binding = 1) readonly buffer Z { vec4 z[]; };
layout(std430, binding = 2) buffer P { vec4 p[]; };

void main() {
  const int t = int(gl_GlobalInvocationID.x);
  if (t >= push.cells.w) return;
  const int group = int(gl_GlobalInvocationID.y);
  const vec4 before = scalars[kRhoBefore * push.partial.w + group];
  const vec4 ratio = scalars[kRho * push.partial.w + group] / before;
  const bool restart = push.partial.z != 0;
  const bvec4 keep = restart ? bvec4(false) : greaterThan(before, vec4(0));
  const int at = group_offset() + t;
  p[at] = z[at] + mix(vec4(0), ratio * p[at], keep);
}
