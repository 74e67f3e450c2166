#version 450
#extension GL_GOOGLE_include_directive : require
// The adjoint's right-hand side along the camera's rays: the transposed look.comp of r = dJ/dPhi, cell by cell.
//
// set 0: 0 where each cell's entries start, 1 entries, 4 s + j of sample s, 2 shares in the first cells, 3 the layers'
//        shares, 4 the surface's, 5 r (read), 6 b (write)
// Size: one thread a cell, 128 along x; y counts the groups.
#include "model.glsl"
layout(std430, binding = 0) readonly buffer Starts { int start[]; };
layout(std430, binding = 1) readonly buffer Entries { int entry[]; };
layout(std430, binding = 2) readonly buffer TapShares { vec2 tap_share[]; };
layout(std430, binding = 3) readonly buffer Shares { vec4 shares[]; };
layout(std430, binding = 4) readonly buffer Surface { vec4 surface[]; };
layout(std430, binding = 5) readonly buffer Rims { vec4 rim[]; };
layout(std430, binding = 6) writeonly buffer B { vec4 b[]; };
#include "camera_path.glsl"

void main() {
  const int t = int(gl_GlobalInvocationID.x);
  if (t >= push.cells.w) return;
  const int axis = face_axis();
  const int pixels = int(gl_GlobalInvocationID.y) * face_count();
  const ivec3 c = cell_of(t, push.cells);
  vec4 sum = vec4(0);
  if (c[axis] == ((push.face.x & 1) == 1 ? push.cells[axis] - 1 : 0)) {
    const int f = raster_of(push.cells, axis, c);
    sum = surface[f].x * surface[f].y * rim[pixels + f];
  }
  for (int e = start[t]; e < start[t + 1]; ++e) {
    const int s = entry[e] / 4;
    sum += shares[s].z * weight_of(tap_share[s], entry[e] % 4) * rim[pixels + s % face_count()];
  }
  b[int(gl_GlobalInvocationID.y) * push.cells.w + t] = sum;
}
