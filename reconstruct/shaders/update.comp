#version 450
#extension GL_GOOGLE_include_directive : require
// The step of conjugate gradients, alpha = rho / gamma (0 where gamma is not positive), and each workgroup's share of
// ||r||^2:
//
//   d += alpha p,   r -= alpha q                                (diffusion/passes.h, update_norm)
//
// set 0: 0 scalars, 1 p, 2 q (read), 3 d, 4 r (read and write), 5 partial sums (write)
// Size: one thread a cell, 128 along x; 128 vec4 (2 KiB) of shared memory for the sum.
#define PARTIAL_BINDING 5
#include "grid.glsl"
#include "partial_sum.glsl"
#include "scalars.glsl"
layout(std430, binding = 0) readonly buffer Scalars { vec4 scalars[]; };
layout(std430, binding = 1) readonly buffer P { vec4 p[]; };
layout(std430, binding = 2) readonly buffer Q { vec4 q[]; };
layout(std430, binding = 3) buffer D { vec4 d[]; };
layout(std430, binding = 4) buffer R { vec4 r[]; };

void main() {
  const int t = int(gl_GlobalInvocationID.x);
  vec4 square = vec4(0);
  if (t < push.cells.w) {
    const int group = int(gl_GlobalInvocationID.y);
    const vec4 gamma = scalars[kGamma * push.partial.w + group];
    const vec4 alpha = mix(vec4(0), scalars[kRho * push.partial.w + group] / gamma, greaterThan(gamma, vec4(0)));
    const int at = group_offset() + t;
    d[at] += alpha * p[at];
    const vec4 residual = r[at] - alpha * q[at];
    r[at] = residual;
    square = residual * residual;
  }
  store_partial_sum(square, 0);
}
