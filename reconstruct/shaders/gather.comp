#version 450
#extension GL_GOOGLE_include_directive : require
// Products of fluence and adjoint, summed over the illuminations (reconstruct/gradient.h):
//
//   sum (psi_i - psi_j)(phi_i - phi_j) with the next cell along x, y and z;   sum psi_i phi_i
//
// set 0: 0 phi, 1 its low part, 2 psi, 3 its low part (read), 4 products (read and write)
// Size: one thread a cell, 128 along x, over all groups.
#include "model.glsl"
layout(std430, binding = 0) readonly buffer Phi { vec4 phi[]; };
layout(std430, binding = 1) readonly buffer PhiLow { vec4 phi_low[]; };
layout(std430, binding = 2) readonly buffer Psi { vec4 psi[]; };
layout(std430, binding = 3) readonly buffer PsiLow { vec4 psi_low[]; };
layout(std430, binding = 4) buffer Products { vec4 products[]; };

void main() {
  const int t = int(gl_GlobalInvocationID.x);
  if (t >= push.cells.w) return;
  const ivec3 c = cell_of(t, push.cells);
  vec4 sum = has(kFirst) ? vec4(0) : products[t];
  for (int group = 0; group < push.face.y; ++group) {
    const int at = group * push.cells.w + t;
    sum.w += dot(psi[at], phi[at]);
    for (int axis = 0; axis < 3; ++axis) {
      if (c[axis] + 1 == push.cells[axis]) continue;
      const int next = at + stride_of(axis);
      sum[axis] += dot((psi[at] - psi[next]) + (psi_low[at] - psi_low[next]),
                       (phi[at] - phi[next]) + (phi_low[at] - phi_low[next]));
    }
  }
  products[t] = sum;
}
