#version 450
#extension GL_GOOGLE_include_directive : require
// The matrix of the block's own grid (docs/physics.md, "Discretisation on a block sample"):
//
//   g = (V / h^2) 2 kappa_i kappa_j / (kappa_i + kappa_j),   wall = (V / h) g_b,   D = V sigma_a + walls + sum g
//
// set 0: 0 kappa and sigma_a (read), 1 low (g before; D), 2 high (g after; D - sum g), 3 sinks and walls (write)
// Size: one thread a cell, 128 along x.
#include "model.glsl"
#include "walls.glsl"
layout(std430, binding = 0) readonly buffer Coefficients { vec2 coefficient[]; };
layout(std430, binding = 1) writeonly buffer Low { vec4 low[]; };
layout(std430, binding = 2) writeonly buffer High { vec4 high[]; };
layout(std430, binding = 3) writeonly buffer Walls { float walls[]; };

float link(int axis, float a, float b) {
  return area_of(axis) / push.size[axis] * 2.0 * a * b / (a + b);
}

void main() {
  const int t = int(gl_GlobalInvocationID.x);
  if (t >= push.cells.w) return;
  const ivec3 c = cell_of(t, push.cells);
  const float kappa = coefficient[t].x;
  vec4 before = vec4(0);
  vec4 after = vec4(0);
  float sink = push.size.w * coefficient[t].y;
  walls[t] = sink;
  for (int axis = 0; axis < 3; ++axis) {
    const int stride = stride_of(axis);
    const float wall = area_of(axis) * surface_conductance(axis, kappa);
    if (c[axis] > 0) {
      before[axis] = link(axis, kappa, coefficient[t - stride].x);
    } else {
      walls[wall_at(push.cells, axis, 0, c)] = wall;
      sink += wall;
    }
    if (c[axis] + 1 < push.cells[axis]) {
      after[axis] = link(axis, kappa, coefficient[t + stride].x);
    } else {
      walls[wall_at(push.cells, axis, 1, c)] = wall;
      sink += wall;
    }
  }
  before.w = sink + before.x + before.y + before.z + after.x + after.y + after.z;
  after.w = sink;
  low[t] = before;
  high[t] = after;
}
