#version 450
#extension GL_GOOGLE_include_directive : require
// x += d, d = 0, with x = high + low in twice float32's digits (Knuth's two-sum).
//
// set 0: 0 d, 1 high part of x, 2 its low part (read and write)
// Size: one thread a cell, 128 along x.
#include "grid.glsl"
layout(std430, binding = 0) buffer D { vec4 d[]; };
layout(std430, binding = 1) buffer High { vec4 high[]; };
layout(std430, binding = 2) buffer Low { vec4 low[]; };

void main() {
  const int t = int(gl_GlobalInvocationID.x);
  if (t >= push.cells.w) return;
  const int at = group_offset() + t;
  const vec4 a = high[at];
  precise vec4 b = low[at] + d[at];
  precise vec4 sum = a + b;
  precise vec4 part = sum - a;
  precise vec4 lost = (a - (sum - part)) + (b - part);
  high[at] = sum;
  low[at] = lost;
  d[at] = vec4(0);
}
