#version 450
#extension GL_GOOGLE_include_directive : require
// The matrix of the next coarser grid: a conductance is the sum over the fine faces between two aggregates over the
// distance of their centres in fine cells; a wall is that of the fine cells in series with half the link inside their
// aggregate; sinks add up; all of it over 1.1, which makes corrections from below that much larger.
//                                                                                  (reconstruct/diffusion/multigrid.h)
//
// set 0: 0 low, 1 high, 2 sinks and walls (read), 3 to 5 the same of the coarse grid (write)
// Size: one thread a coarse cell, 128 along x.
#include "model.glsl"
#include "walls.glsl"
layout(std430, binding = 0) readonly buffer Low { vec4 low[]; };
layout(std430, binding = 1) readonly buffer High { vec4 high[]; };
layout(std430, binding = 2) readonly buffer Walls { float walls[]; };
layout(std430, binding = 3) writeonly buffer CoarseLow { vec4 coarse_low[]; };
layout(std430, binding = 4) writeonly buffer CoarseHigh { vec4 coarse_high[]; };
layout(std430, binding = 5) writeonly buffer CoarseWalls { float coarse_walls[]; };

const float kOvercorrection = 1.1;

float wall_behind(int t, ivec3 c, int axis, int side) {
  const float outer = 1.0 / walls[wall_at(push.cells, axis, side, c)];
  const bool alone = push.ratio[axis] == 1 || (side == 1 && (c[axis] & 1) == 0);
  if (alone) return 1.0 / outer;
  return 1.0 / (0.5 / (side == 0 ? high[t][axis] : low[t][axis]) + outer);
}

void main() {
  const int t = int(gl_GlobalInvocationID.x);
  if (t >= push.coarse.w) return;
  const ivec3 own = cell_of(t, push.coarse);
  const ivec3 first = own * push.ratio.xyz;
  const ivec3 last = min(first + push.ratio.xyz, push.cells.xyz) - 1;
  vec3 before = vec3(0);
  vec3 after = vec3(0);
  vec3 near = vec3(0);
  vec3 far = vec3(0);
  float sink = 0.0;
  for (int k = first.z; k <= last.z; ++k)
    for (int j = first.y; j <= last.y; ++j)
      for (int i = first.x; i <= last.x; ++i) {
        const ivec3 c = ivec3(i, j, k);
        const int at = (k * push.cells.y + j) * push.cells.x + i;
        sink += walls[at];
        for (int axis = 0; axis < 3; ++axis) {
          const int n = push.cells[axis];
          const bool paired = push.ratio[axis] == 2;
          if (c[axis] == first[axis] && c[axis] > 0)
            before[axis] += low[at][axis] / (!paired ? 1.0 : c[axis] + 1 < n ? 2.0 : 1.5);
          if (c[axis] == last[axis] && c[axis] + 1 < n)
            after[axis] += high[at][axis] / (!paired ? 1.0 : c[axis] + 2 < n ? 2.0 : 1.5);
          if (c[axis] == 0) near[axis] += wall_behind(at, c, axis, 0);
          if (c[axis] + 1 == n) far[axis] += wall_behind(at, c, axis, 1);
        }
      }
  before /= kOvercorrection;
  after /= kOvercorrection;
  near /= kOvercorrection;
  far /= kOvercorrection;
  coarse_walls[t] = sink;
  for (int axis = 0; axis < 3; ++axis) {
    if (own[axis] == 0) coarse_walls[wall_at(push.coarse, axis, 0, own)] = near[axis];
    if (own[axis] + 1 == push.coarse[axis]) coarse_walls[wall_at(push.coarse, axis, 1, own)] = far[axis];
    sink += near[axis] + far[axis];
  }
  coarse_low[t] = vec4(before, sink + before.x + before.y + before.z + after.x + after.y + after.z);
  coarse_high[t] = vec4(after, sink);
}
