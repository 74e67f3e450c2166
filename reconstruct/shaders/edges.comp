#version 450
#extension GL_GOOGLE_include_directive : require
// The smoothness prior R(u) of u = log kappa and log sigma_a, and how much each cell resists its neighbours: with
// S = lambda V / l |grad u|^2 of the cell and 1/e^2 = 0 for the H1 prior              (reconstruct/regularizer.h)
//
//   R = sum S / (1 + sqrt(1 + |grad u|^2 / e^2)),   weight = 1/2 (1 + |grad u|^2 / e^2)^(-1/2)
//
// set 0: 0 p, 1 kappa and sigma_a (read), 2 weights (write), 3 sums
// Size: kSumGroups workgroups over the cells.
#define SUMS_BINDING 3
#include "model.glsl"
#include "sums.glsl"
#include "slots.glsl"
layout(std430, binding = 0) readonly buffer Parameters { float p[]; };
layout(std430, binding = 1) readonly buffer Coefficients { vec2 coefficient[]; };
layout(std430, binding = 2) writeonly buffer Edges { vec2 edge[]; };
#include "logarithms.glsl"

void main() {
  vec2 smooth_diffusion = vec2(0);
  vec2 smooth_absorption = vec2(0);
  for (int t = int(gl_GlobalInvocationID.x); t < push.cells.w; t += kSumThreads) {
    const ivec3 c = cell_of(t, push.cells);
    const vec2 own = logarithms(t);
    vec2 square = vec2(0);
    for (int axis = 0; axis < 3; ++axis) {
      const int stride = stride_of(axis);
      vec2 step = c[axis] > 0 ? own - logarithms(t - stride) : vec2(0);
      square += 0.5 * push.smoothness[axis] * step * step;
      step = c[axis] + 1 < push.cells[axis] ? own - logarithms(t + stride) : vec2(0);
      square += 0.5 * push.smoothness[axis] * step * step;
    }
    const vec2 root = sqrt(1.0 + square * push.smoothness.w);
    edge[t] = 0.5 / root;
    const vec2 value = square / (1.0 + root);
    smooth_diffusion = add_to(smooth_diffusion, value.x);
    smooth_absorption = add_to(smooth_absorption, value.y);
  }
  store_sum(kSmoothDiffusion, smooth_diffusion, true);
  store_sum(kSmoothAbsorption, smooth_absorption, true);
}
