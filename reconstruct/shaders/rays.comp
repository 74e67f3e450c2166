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

// e^x - 1; below 1/2 by its series, whose ninth term is below float32's rounding
float exp_minus_one(float x) {
  if (abs(x) > 0.5) return exp(x) - 1.0;
  float sum = 1.0;
  for (int n = 9; n > 1; --n) sum = 1.0 + sum * x / float(n);
  return x * sum;
}
// Below t = 1 the closed forms cancel; there Bernoulli's series t/12 - t^3/720 + t^5/30240 - t^7/1209600 + t^9/47900160.
float beta_of(float t) {
  const float s = t * t;
  if (t < 1.0)
    return t * (1.0 / 12.0 - s * (1.0 / 720.0 - s * (1.0 / 30240.0 - s * (1.0 / 1209600.0 - s / 47900160.0))));
  return 0.5 - 1.0 / t + 1.0 / exp_minus_one(t);
}
float beta_slope_of(float t) {
  const float s = t * t;
  if (t < 1.0)
    return 1.0 / 12.0 - s * (1.0 / 240.0 - s * (1.0 / 6048.0 - s * (1.0 / 172800.0 - s / 5322240.0)));
  return 1.0 / s + 1.0 / (exp_minus_one(t) * exp_minus_one(-t));
}

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
