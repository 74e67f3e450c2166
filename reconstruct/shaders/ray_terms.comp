#version 450
#extension GL_GOOGLE_include_directive : require
// The ray terms of the gradient (docs/physics.md, "Gradient, in full"), summed over the illuminations, with
// lambda_n = (1 - beta_n) psi_n + beta_n psi_(n-1), lambda_1 = (1 - e) psi_1 + e r / a:
//
//   dJ/dsigma_a,n = -3 kappa P D lambda
//   dJ/dkappa_n   = -3 sigma_a P D lambda + (h / (3 kappa^2)) (sum_(m>n) lambda_m Q_m - P alpha' E lambda) + beta' terms
//
// set 0: 0 kappa and sigma_a, 1 rays, 2 q, 3 r (of a ray's Phi along rays), 4 psi, 5 its low part, 6 camera gains (read),
//        7 d/dkappa, d/dsigma_a (read and write)
// Size: one thread a ray, 128 along the lit face, over all groups; from the far end, for the sum.
#include "model.glsl"
layout(std430, binding = 0) readonly buffer Coefficients { vec2 coefficient[]; };
layout(std430, binding = 1) readonly buffer Rays { vec4 ray[]; };
layout(std430, binding = 2) readonly buffer Irradiance { vec4 irradiance[]; };
layout(std430, binding = 3) readonly buffer Rims { vec4 rim[]; };
layout(std430, binding = 4) readonly buffer Psi { vec4 psi[]; };
layout(std430, binding = 5) readonly buffer PsiLow { vec4 psi_low[]; };
layout(std430, binding = 6) readonly buffer Camera { vec2 camera[]; };
layout(std430, binding = 7) buffer Gradient { vec2 gradient[]; };
#include "ray_cell.glsl"

void main() {
  const int f = int(gl_GlobalInvocationID.x);
  if (f >= face_count()) return;
  const int axis = face_axis();
  const float h = push.size[axis];
  const int depth = push.cells[axis];
  for (int group = 0; group < push.face.y; ++group) {
    const int n_face = group * face_count() + f;
    const vec4 power = area_of(axis) * irradiance[n_face];
    vec4 rim_here = has(kSeen) ? rim[n_face] / area_of(axis) : vec4(0);
    if (has(kSeen) && has(kAlongRays)) rim_here *= camera[f].x > 0.0 ? camera[f].y / camera[f].x : 0.0;
    vec4 beyond = vec4(0);
    int cell = cell_behind(f) + (depth - 1) * face_inwards();
    for (int n = depth - 1; n >= 0; --n, cell -= face_inwards()) {
      const float kappa = coefficient[cell].x;
      const float absorption = coefficient[cell].y;
      const vec4 r = ray[cell];
      const int at = group * push.cells.w + cell;
      const int before = at - face_inwards();
      const float dt = h / (3.0 * kappa * kappa);
      const float albedo = 1.0 - 3.0 * kappa * absorption;
      const vec4 share = power * (albedo * r.x);
      vec4 lambda;
      vec4 d_kappa;
      if (n > 0) {
        const vec4 rise = (psi[before] - psi[at]) + (psi_low[before] - psi_low[at]);
        lambda = psi[at] + r.z * rise;
        d_kappa = -share * rise * (r.w * dt);
      } else {
        const float e = escape_of(cell);
        const float gb = surface_conductance(axis, kappa);
        lambda = (1.0 - e) * psi[at] + e * rim_here;
        d_kappa = share * (rim_here - psi[at]) *
                  ((h / kappa) * (gb * gb * h * r.z / (2.0 * kappa * kappa) - gb * r.w * dt - gb * r.z / kappa));
      }
      d_kappa += -3.0 * absorption * r.x * power * lambda + dt * (beyond - (albedo * r.y) * power * lambda);
      const vec2 sum = has(kFirst) && group == 0 ? vec2(0) : gradient[cell];
      gradient[cell] = sum + vec2(dot(d_kappa, vec4(1)), -3.0 * kappa * r.x * dot(power, lambda));
      beyond += lambda * share;
    }
  }
}
