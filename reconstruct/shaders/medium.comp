#version 450
#extension GL_GOOGLE_include_directive : require
// Coefficients from parameters: sigma = exp p, kappa = 1 / (3 (sigma_a + sigma_s'))      (reconstruct/diffusion/medium.h)
//
// set 0: 0 p, all log sigma_s' first (read), 1 kappa and sigma_a (write)
// Size: one thread a cell, 128 along x.
#include "model.glsl"
layout(std430, binding = 0) readonly buffer Parameters { float p[]; };
layout(std430, binding = 1) writeonly buffer Coefficients { vec2 coefficient[]; };

void main() {
  const int t = int(gl_GlobalInvocationID.x);
  if (t >= push.cells.w) return;
  const float absorption = exp(p[push.cells.w + t]);
  coefficient[t] = vec2(1.0 / (3.0 * (absorption + exp(p[t]))), absorption);
}
