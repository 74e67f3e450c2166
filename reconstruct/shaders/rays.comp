#version 450
#extension GL_GOOGLE_include_directive : require
// What a perpendicular ray of unit power leaves in each cell (reconstruct/diffusion/source.h): with t = h / (3 kappa),
//
//   E_n = E_(n-1) e^-t,  D_n = E_(n-1) - E_n,  beta = 1/2 - 1/t + 1/(e^t - 1),  beta' = 1/t^2 - e^t/(e^t - 1)^2
//
// set 0: 0 kappa and sigma_a (read), 1 D, E, beta, beta' of each cell (write)
// Size: one thread a ray, 128 along the lit face.
#include "model.glsl"
layout(std430, binding = 0) readonly buffer Coefficients { vec2 coefficient[]; };
layout(std430, binding = 1) writeonly buffer Rays { vec4 ray[]; };
#include "centroid.glsl"

void main() {
  const int f = int(gl_GlobalInvocationID.x);
  if (f >= face_count()) return;
  int cell = cell_behind(f);
  float arriving = 1.0;
  for (int n = 0; n < push.cells[face_axis()]; ++n, cell += face_inwards()) {
    const float t = push.size[face_axis()] / (3.0 * coefficient[cell].x);
    const float deposited = -arriving * exp_minus_one(-t);
    arriving *= exp(-t);
    const vec2 beta = has(kCentroid) ? vec2(beta_of(t), beta_slope_of(t)) : vec2(0);
    ray[cell] = vec4(deposited, arriving, beta);
  }
}
