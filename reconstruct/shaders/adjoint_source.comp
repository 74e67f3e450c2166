#version 450
#extension GL_GOOGLE_include_directive : require
// The adjoint's right-hand side, b_i = r_f g_b behind the seen face; elsewhere b is zero already.
//
// set 0: 0 kappa and sigma_a, 1 r (read), 2 b (write)
// Size: one thread a cell of the seen face, 128 along it; y counts the groups.
#include "model.glsl"
layout(std430, binding = 0) readonly buffer Coefficients { vec2 coefficient[]; };
layout(std430, binding = 1) readonly buffer Rims { vec4 rim[]; };
layout(std430, binding = 2) writeonly buffer B { vec4 b[]; };

void main() {
  const int f = int(gl_GlobalInvocationID.x);
  if (f >= face_count()) return;
  const int group = int(gl_GlobalInvocationID.y);
  const int cell = cell_behind(f);
  b[group * push.cells.w + cell] =
      surface_conductance(face_axis(), coefficient[cell].x) * rim[group * face_count() + f];
}
