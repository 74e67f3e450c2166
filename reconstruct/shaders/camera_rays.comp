#version 450
#extension GL_GOOGLE_include_directive : require
// The camera's rays through a medium (reconstruct/diffusion/camera_rays.h): t_n, alpha'_n, D_n, E_n, b_n and the share of
// each v_n in Phi = sum_n alpha'_n D_n ((1 - b_n) v_n + b_n v_(n-1)) + alpha'_N E_N (v_N + k (v_N - v_(N-1))).
//
// set 0: 0 kappa and sigma_a, 1 first cells, 2 shares in them, 3 length of a layer (read);
//        4 t, alpha', D, E; 5 b, db/dt, share; 6 share of v_0, of phi in it, d of that by kappa, layers crossed (write)
// Size: one thread a pixel, 128 along the seen face.
#include "model.glsl"
layout(std430, binding = 0) readonly buffer Coefficients { vec2 coefficient[]; };
layout(std430, binding = 1) readonly buffer TapCells { int tap_cell[]; };
layout(std430, binding = 2) readonly buffer TapShares { vec2 tap_share[]; };
layout(std430, binding = 3) readonly buffer Lengths { float layer_length[]; };
layout(std430, binding = 4) writeonly buffer Losses { vec4 losses[]; };
layout(std430, binding = 5) buffer Shares { vec4 shares[]; };
layout(std430, binding = 6) writeonly buffer Surface { vec4 surface[]; };
#include "camera_path.glsl"
#include "centroid.glsl"

const float kFaintest = 1e-4;  // E_N, where a ray may end

void main() {
  const int f = int(gl_GlobalInvocationID.x);
  if (f >= face_count()) return;
  const int axis = face_axis();
  const int layers = push.cells[axis];
  float arriving = 1.0;
  float of_surface = 0.0;
  float before = 0.0;  // the share of v_(n-1) so far
  int n = 0;
  vec2 last = vec2(0);  // t, alpha'
  for (; n < layers && (n == 0 || arriving > kFaintest); ++n) {
    const int s = n * face_count() + f;
    float inverse = 0.0;
    float lost = 0.0;
    for (int j = 0; j < 4; ++j) {
      const vec2 c = coefficient[tap_cell[s] + corner_of(j)];
      const float w = weight_of(tap_share[s], j);
      inverse += w / (3.0 * c.x);
      lost += w * 3.0 * c.x * c.y;
    }
    const float t = layer_length[f] * inverse;
    const float albedo = 1.0 - lost;
    const float twice = n == 0 ? 2.0 : 1.0;
    const float b = twice * beta_of(t);
    const float deposited = -arriving * exp_minus_one(-t);
    const float emitted = albedo * deposited;
    arriving *= exp(-t);
    losses[s] = vec4(t, albedo, deposited, arriving);
    shares[s] = vec4(b, twice * beta_slope_of(t), emitted * (1.0 - b), 0.0);
    if (n == 0) of_surface = emitted * b;
    else shares[s - face_count()].z = before + emitted * b;
    before = emitted * (1.0 - b);
    last = vec2(t, albedo);
  }
  const float beyond = last.y * arriving;
  const float slope = (n == 1 ? 2.0 : 1.0) * (0.5 + 1.0 / last.x);
  shares[(n - 1) * face_count() + f].z = before + beyond * (1.0 + slope);
  if (n == 1) of_surface -= beyond * slope;
  else shares[(n - 2) * face_count() + f].z -= beyond * slope;
  const float kappa = coefficient[cell_behind(f)].x;
  const float gb = surface_conductance(axis, kappa);
  const float of_fluence = push.surface.x * gb;
  surface[f] = vec4(of_surface, of_fluence, of_fluence * gb * push.size[axis] / (2.0 * kappa * kappa), n);
  for (; n < layers; ++n) {
    losses[n * face_count() + f] = vec4(0);
    shares[n * face_count() + f] = vec4(0);
  }
}
