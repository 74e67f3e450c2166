#version 450
#extension GL_GOOGLE_include_directive : require
// The right-hand side of four illuminations through the lit face, all cells (reconstruct/diffusion/source.h):
//
//   surface     b_1 = a g_b 4 q / (1 - R_phi)
//   collimated  b_n = Q_n (1 - beta_n) + Q_(n+1) beta_(n+1),  Q_n = a q alpha'_n D_n;  in the first cell (1 - e) for 1 - beta
//
// set 0: 0 kappa and sigma_a, 1 rays, 2 q of the face (read), 3 b (write)
// Size: one thread a ray, 128 along the lit face; y counts the groups.
#include "model.glsl"
layout(std430, binding = 0) readonly buffer Coefficients { vec2 coefficient[]; };
layout(std430, binding = 1) readonly buffer Rays { vec4 ray[]; };
layout(std430, binding = 2) readonly buffer Irradiance { vec4 irradiance[]; };
layout(std430, binding = 3) writeonly buffer B { vec4 b[]; };
#include "ray_cell.glsl"

void main() {
  const int f = int(gl_GlobalInvocationID.x);
  if (f >= face_count()) return;
  const int group = int(gl_GlobalInvocationID.y);
  const int axis = face_axis();
  const vec4 power = area_of(axis) * irradiance[group * face_count() + f];
  int cell = cell_behind(f);
  const int first = group * push.cells.w;
  const int depth = push.cells[axis];
  if (!has(kCollimated)) {
    b[first + cell] = surface_conductance(axis, coefficient[cell].x) * push.surface.y * power;
    for (int n = 1; n < depth; ++n) b[first + cell + n * face_inwards()] = vec4(0);
    return;
  }
  for (int n = 0; n < depth; ++n, cell += face_inwards()) {
    const float kept = 1.0 - (n == 0 ? escape_of(cell) : ray[cell].z);
    float share = share_of(cell) * kept;
    if (n + 1 < depth) share += share_of(cell + face_inwards()) * ray[cell + face_inwards()].z;
    b[first + cell] = share * power;
  }
}
