#version 450
#extension GL_GOOGLE_include_directive : require
// What the camera's rays add to the gradient by a cell's kappa and sigma_a, through t and alpha' of the layers' samples:
//
//   dJ/dkappa = -sum w (h_t / (3 kappa^2) dJ/dt + 3 sigma_a dJ/dalpha'),   dJ/dsigma_a = -sum w 3 kappa dJ/dalpha'
//
// set 0: 0 kappa and sigma_a, 1 where each cell's entries start, 2 entries, 3 shares in the first cells, 4 slopes,
//        5 sums, the last of them the surface's (read), 6 d/dkappa, d/dsigma_a (read and write)
// Size: one thread a cell, 128 along x.
#include "model.glsl"
layout(std430, binding = 0) readonly buffer Coefficients { vec2 coefficient[]; };
layout(std430, binding = 1) readonly buffer Starts { int start[]; };
layout(std430, binding = 2) readonly buffer Entries { int entry[]; };
layout(std430, binding = 3) readonly buffer TapShares { vec2 tap_share[]; };
layout(std430, binding = 4) readonly buffer Slopes { vec2 slopes[]; };
layout(std430, binding = 5) readonly buffer Sums { float sums[]; };
layout(std430, binding = 6) buffer Gradient { vec2 gradient[]; };
#include "camera_path.glsl"

void main() {
  const int t = int(gl_GlobalInvocationID.x);
  if (t >= push.cells.w) return;
  const int axis = face_axis();
  const ivec3 c = cell_of(t, push.cells);
  vec2 by = vec2(0);
  for (int e = start[t]; e < start[t + 1]; ++e) {
    const int s = entry[e] / 4;
    by += weight_of(tap_share[s], entry[e] % 4) * slopes[s];
  }
  const float kappa = coefficient[t].x;
  vec2 sum = -vec2(by.x / (kappa * kappa) + 3.0 * coefficient[t].y * by.y, 3.0 * kappa * by.y);
  if (c[axis] == ((push.face.x & 1) == 1 ? push.cells[axis] - 1 : 0))
    sum.x += sums[(push.cells[axis] + 1) * face_count() + raster_of(push.cells, axis, c)];
  gradient[t] = (has(kCollimated) ? gradient[t] : vec2(0)) + sum;
}
