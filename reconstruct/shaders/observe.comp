#version 450
#extension GL_GOOGLE_include_directive : require
// What the camera sees of four illuminations, and how it differs from the pictures:
//
//   J_n = g_b (phi - S) + X,   L = source_gain S + flux_gain J_n,   r = w (L - L*) flux_gain,   chi^2 = sum w (L - L*)^2
//
// and along refracted rays, where look.comp has left Phi in r:   L = source_gain Phi + flux_gain X,   r = w (L - L*) source_gain
//                                              (reconstruct/diffusion/camera_equation.h; S, X: diffusion/source.h)
// set 0: 0 kappa and sigma_a, 1 rays, 2 q of the lit face, 3 phi, 4 its low part, 5 camera gains, 6 L*, 7 w (read),
//        8 r (read along rays, and write), 9 sums
// Size: kSumGroups workgroups over the seen face of every group.
#define SUMS_BINDING 9
#include "model.glsl"
#include "sums.glsl"
#include "slots.glsl"
layout(std430, binding = 0) readonly buffer Coefficients { vec2 coefficient[]; };
layout(std430, binding = 1) readonly buffer Rays { vec4 ray[]; };
layout(std430, binding = 2) readonly buffer Irradiance { vec4 irradiance[]; };
layout(std430, binding = 3) readonly buffer High { vec4 phi[]; };
layout(std430, binding = 4) readonly buffer Low { vec4 phi_low[]; };
layout(std430, binding = 5) readonly buffer Camera { vec2 camera[]; };
layout(std430, binding = 6) readonly buffer Pictures { vec4 picture[]; };
layout(std430, binding = 7) readonly buffer Weights { vec4 weight[]; };
layout(std430, binding = 8) buffer Rims { vec4 rim[]; };
#include "ray_cell.glsl"

void main() {
  const int axis = face_axis();
  vec2 chi_squared = vec2(0);
  for (int n = int(gl_GlobalInvocationID.x); n < face_count() * push.face.y; n += kSumThreads) {
    const int f = n % face_count();
    const int cell = cell_behind(f);
    const int at = n / face_count() * push.cells.w + cell;
    vec4 source = vec4(0);
    vec4 escape = vec4(0);
    if (has(kLit) && has(kCollimated)) escape = irradiance[n] * (share_of(cell) * escape_of(cell));
    if (has(kLit) && !has(kCollimated)) source = push.surface.y * irradiance[n];
    vec4 radiance;
    if (has(kAlongRays)) {
      radiance = camera[f].x * rim[n] + camera[f].y * escape;
    } else {
      const vec4 flux = surface_conductance(axis, coefficient[cell].x) * ((phi[at] - source) + phi_low[at]) + escape;
      radiance = camera[f].x * source + camera[f].y * flux;
    }
    const vec4 misfit = radiance - picture[n];
    const vec4 weighted = weight[n] * misfit;
    rim[n] = (has(kAlongRays) ? camera[f].x : camera[f].y) * weighted;
    const vec4 square = weighted * misfit;
    for (int lane = 0; lane < 4; ++lane) chi_squared = add_to(chi_squared, square[lane]);
  }
  store_sum(kChiSquared, chi_squared, has(kFirst));
}
