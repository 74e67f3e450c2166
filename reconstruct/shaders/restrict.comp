#version 450
#extension GL_GOOGLE_include_directive : require
// The residual handed down, r_coarse = P^T r_fine, gathered by each coarse cell I:
//
//   r_I = sum over I's red cells f of (1 - sum_a w_a,f) r_f  +  sum over red cells f beside I along axis a of w_a,f r_f
//                                                               (diffusion/multigrid.h; black residuals are zero)
// set 0: 0 transfer (w along x, y, z; 1 - their sum), 1 fine residual in z (read), 2 r of the coarse grid (write)
// Size: one thread a coarse cell, 128 along x.
#include "grid.glsl"
layout(std430, binding = 0) readonly buffer Transfer { vec4 transfer[]; };
layout(std430, binding = 1) readonly buffer Fine { vec4 fine[]; };
layout(std430, binding = 2) writeonly buffer Coarse { vec4 coarse_r[]; };

// The red fine cells from `first` to `last`, with weight `which` of transfer.
vec4 gather(ivec3 first, ivec3 last, int which) {
  vec4 sum = vec4(0);
  for (int k = first.z; k <= last.z; ++k)
    for (int j = first.y; j <= last.y; ++j)
      for (int i = first.x + ((first.x + j + k) & 1); i <= last.x; i += 2) {
        const int at = index_of(ivec3(i, j, k));
        sum += transfer[at][which] * fine[group_offset() + at];
      }
  return sum;
}

void main() {
  const int t = int(gl_GlobalInvocationID.x);
  if (t >= push.coarse.w) return;
  const ivec3 c = ivec3(t % push.coarse.x, t / push.coarse.x % push.coarse.y, t / (push.coarse.x * push.coarse.y));
  const ivec3 first = c * push.ratio.xyz;
  const ivec3 last = min(first + push.ratio.xyz, push.cells.xyz) - 1;
  vec4 sum = gather(first, last, 3);
  for (int axis = 0; axis < 3; ++axis) {
    if (push.ratio[axis] == 1) continue;
    ivec3 a = first;
    ivec3 b = last;
    a[axis] = b[axis] = first[axis] - 1;
    if (a[axis] >= 0) sum += gather(a, b, axis);
    a[axis] = b[axis] = first[axis] + 2;
    if (a[axis] < push.cells[axis]) sum += gather(a, b, axis);
  }
  coarse_r[int(gl_GlobalInvocationID.y) * push.coarse.w + t] = sum;
}
