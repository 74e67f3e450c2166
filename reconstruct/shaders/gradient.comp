#version 450
#extension GL_GOOGLE_include_directive : require
// The gradient in p = (log sigma_s', log sigma_a) from what the illuminations added up (reconstruct/gradient.h), with the
// smoothness prior's, sum_faces lambda a / (h l) (weight_i + weight_j) (u_i - u_j), of u = log kappa and log sigma_a:
//
//   dJ/dlog sigma_s' = -3 sigma_s' kappa dJ/dlog kappa
//   dJ/dlog sigma_a  = dJ/dlog sigma_a at fixed kappa - 3 sigma_a kappa dJ/dlog kappa
//
// set 0: 0 p, 1 kappa and sigma_a, 2 products, 3 ray terms, 4 terms of the lit face, 5 of the seen one (read),
//        6 the prior's weights (read), 7 gradient (write)
// Size: one thread a cell, 128 along x.
#include "model.glsl"
layout(std430, binding = 0) readonly buffer Parameters { float p[]; };
layout(std430, binding = 1) readonly buffer Coefficients { vec2 coefficient[]; };
layout(std430, binding = 2) readonly buffer Products { vec4 products[]; };
layout(std430, binding = 3) readonly buffer RayTerms { vec2 ray_terms[]; };
layout(std430, binding = 4) readonly buffer LitTerms { float lit_terms[]; };
layout(std430, binding = 5) readonly buffer SeenTerms { float seen_terms[]; };
layout(std430, binding = 6) readonly buffer Edges { vec2 edge[]; };
layout(std430, binding = 7) writeonly buffer Gradient { float gradient[]; };
#include "logarithms.glsl"

float inner_face(int axis, float product, float own, float other) {
  const float share = other / (own + other);
  return -2.0 * area_of(axis) / push.size[axis] * product * share * share;
}

float rim(int axis, int side, ivec3 c, float mass) {
  const int face = 2 * axis + side;
  float sum = -area_of(axis) * mass;
  if (face == push.face.x) sum += lit_terms[raster_of(push.cells, axis, c)];
  if (face == push.face.z && push.face.z != push.face.x) sum += seen_terms[raster_of(push.cells, axis, c)];
  return sum;
}

// Of the prior, by the logarithms.
vec2 resistance(int t, int neighbour, int axis) {
  return push.smoothness[axis] * (edge[t] + edge[neighbour]) * (logarithms(t) - logarithms(neighbour));
}

void main() {
  const int t = int(gl_GlobalInvocationID.x);
  if (t >= push.cells.w) return;
  const ivec3 c = cell_of(t, push.cells);
  const float kappa = coefficient[t].x;
  const float absorption = coefficient[t].y;
  const vec4 own = products[t];
  float d_kappa = ray_terms[t].x;
  vec2 d_log = vec2(0);
  for (int axis = 0; axis < 3; ++axis) {
    const int stride = stride_of(axis);
    const float gb = surface_conductance(axis, kappa);
    const float wall = gb * gb * push.size[axis] / (2.0 * kappa * kappa);
    if (c[axis] > 0) {
      d_kappa += inner_face(axis, products[t - stride][axis], kappa, coefficient[t - stride].x);
      d_log += resistance(t, t - stride, axis);
    } else {
      d_kappa += wall * rim(axis, 0, c, own.w);
    }
    if (c[axis] + 1 < push.cells[axis]) {
      d_kappa += inner_face(axis, own[axis], kappa, coefficient[t + stride].x);
      d_log += resistance(t, t + stride, axis);
    } else {
      d_kappa += wall * rim(axis, 1, c, own.w);
    }
  }
  d_log += vec2(kappa * d_kappa, absorption * (ray_terms[t].y - push.size.w * own.w));
  gradient[t] = -3.0 * exp(p[t]) * kappa * d_log.x;
  gradient[push.cells.w + t] = d_log.y - 3.0 * absorption * kappa * d_log.x;
}
