#version 450
#extension GL_GOOGLE_include_directive : require
// The weights of prolongation, w_a = R_I / (R_I + R_f + R_J), from the resistances between the centre of a cell's own
// aggregate I, its face, and the centre of the aggregate J it touches; at a wall R_J = 0 and R_f is the wall's. Where they
// add up to more than one they share one.                                          (reconstruct/diffusion/multigrid.h)
//
// set 0: 0 low, 1 high, 2 sinks and walls (read), 3 transfer (w along x, y, z; 1 - their sum) (write)
// Size: one thread a fine cell, 128 along x.
#include "model.glsl"
#include "walls.glsl"
layout(std430, binding = 0) readonly buffer Low { vec4 low[]; };
layout(std430, binding = 1) readonly buffer High { vec4 high[]; };
layout(std430, binding = 2) readonly buffer Walls { float walls[]; };
layout(std430, binding = 3) writeonly buffer Transfer { vec4 transfer[]; };

// An odd cell looks along the axis, an even one back.
float weight(int t, ivec3 c, int axis) {
  const int n = push.cells[axis];
  const int stride = stride_of(axis);
  const bool odd = (c[axis] & 1) == 1;
  if (!odd && c[axis] + 1 == n) return 0.0;  // alone in its aggregate: its centre is the aggregate's
  const float own = 0.5 / (odd ? low[t][axis] : high[t][axis]);
  const int at = c[axis] + (odd ? 1 : -1);
  if (at < 0 || at >= n) return own / (own + 1.0 / walls[wall_at(push.cells, axis, odd ? 1 : 0, c)]);
  const float face = 1.0 / (odd ? high[t][axis] : low[t][axis]);
  float other = 0.0;
  if (odd && at + 1 < n) other = 0.5 / high[t + stride][axis];
  if (!odd) other = 0.5 / low[t - stride][axis];
  return own / (own + face + other);
}

void main() {
  const int t = int(gl_GlobalInvocationID.x);
  if (t >= push.cells.w) return;
  const ivec3 c = cell_of(t, push.cells);
  vec3 w = vec3(0);
  for (int axis = 0; axis < 3; ++axis)
    if (push.ratio[axis] == 2) w[axis] = weight(t, c, axis);
  w /= max(1.0, w.x + w.y + w.z);
  transfer[t] = vec4(w, 1.0 - (w.x + w.y + w.z));
}
