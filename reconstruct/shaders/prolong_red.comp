#version 450
#extension GL_GOOGLE_include_directive : require
// The correction from below and the red half-sweep kept from the way down, in red cells:
//
//   z_f = r_f / D_f + (1 - sum_a w_a) e_I + sum_a w_a e_Ja      (diffusion/passes.h, prolong_smooth; multigrid.h)
//
// On the last grid ratio is 0 and there is no correction.
// set 0: 0 low, 1 transfer, 2 r, 3 z of the coarse grid (read), 4 z (write red)
// Size: one thread a red cell, 128 along x.
#include "grid.glsl"
layout(std430, binding = 0) readonly buffer Low { vec4 low[]; };
layout(std430, binding = 1) readonly buffer Transfer { vec4 transfer[]; };
layout(std430, binding = 2) readonly buffer R { vec4 r[]; };
layout(std430, binding = 3) readonly buffer Coarse { vec4 coarse_z[]; };
layout(std430, binding = 4) writeonly buffer Z { vec4 z[]; };

vec4 correction(ivec3 c, int at) {
  const int first = int(gl_GlobalInvocationID.y) * push.coarse.w;
  const ivec3 above = c / push.ratio.xyz;
  const ivec3 stride = ivec3(1, push.coarse.x, push.coarse.x * push.coarse.y);
  const int own = first + above.x + above.y * stride.y + above.z * stride.z;
  vec4 sum = transfer[at].w * coarse_z[own];
  for (int axis = 0; axis < 3; ++axis) {
    if (push.ratio[axis] == 1) continue;
    const int step = (c[axis] & 1) == 1 ? 1 : -1;
    const int beside = above[axis] + step;
    if (beside >= 0 && beside < push.coarse[axis])
      sum += transfer[at][axis] * coarse_z[own + step * stride[axis]];
  }
  return sum;
}

void main() {
  const ivec3 c = colored_cell();
  if (c.x < 0) return;
  const int at = index_of(c);
  vec4 value = r[group_offset() + at] / low[at].w;
  if (push.ratio.x > 0) value += correction(c, at);
  z[group_offset() + at] = value;
}
