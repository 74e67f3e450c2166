#version 450
#extension GL_GOOGLE_include_directive : require
// Radiance towards the camera where the sample's ray meets the face (docs/physics.md, "Radiance towards a camera"):
//
//   L = F_t(eta, mu_o) / (4 pi eta^2) (phi_s + 3 J_n mu_i) + L_s,   mu_i = sqrt(1 - (1 - mu_o^2) / eta^2)
//
// set 0: 0 scene, 1 field (read): for each face cell phi_s (rgb), J_n (rgb), L_s (rgb), in vec4s
#include "scene.glsl"
layout(location = 0) flat in int face;
layout(location = 1) noperspective in vec2 undistorted;
layout(location = 0) out vec4 radiance;  // rgb, coverage
layout(std430, binding = 1) readonly buffer Field { vec4 field[]; };

const float kPi = 3.14159265358979;
const float kRounding = 4e-7;  // of the way from the camera: so no ray slips between two faces at their edge

// Solves distort(p) = target by Newton's method from a point within a few hundredths of a pixel.
vec2 undistort(vec2 target, vec2 p) {
  const vec4 d = scene.distortion;
  for (int i = 0; i < 4; ++i) {
    const float r2 = dot(p, p);
    const float radial = 1.0 + r2 * (d.x + r2 * (d.y + r2 * scene.optics.x));
    const float slope = 2.0 * (d.x + r2 * (2.0 * d.y + r2 * 3.0 * scene.optics.x));  // d radial / d(r2 / 2)
    const float xy = slope * p.x * p.y + 2.0 * (d.z * p.x + d.w * p.y);
    const float xx = radial + slope * p.x * p.x + 2.0 * d.z * p.y + 6.0 * d.w * p.x;
    const float yy = radial + slope * p.y * p.y + 6.0 * d.z * p.y + 2.0 * d.w * p.x;
    const vec2 miss = target - distort(p);
    p += vec2(yy * miss.x - xy * miss.y, xx * miss.y - xy * miss.x) / (xx * yy - xy * xy);
  }
  return p;
}

// Bilinear between the centres of face cells, constant beyond the last; `which` is 0 for phi_s, 1 for J_n, 2 for L_s.
vec3 sample_field(vec2 at, ivec2 size, int which) {
  const vec2 p = clamp(at - 0.5, vec2(0), vec2(size - 1));
  const ivec2 a = ivec2(p);
  const ivec2 b = min(a + 1, size - 1);
  const vec2 t = p - vec2(a);
  const int first = scene.first[face / 4][face % 4];
  const vec3 low = mix(field[3 * (first + a.y * size.x + a.x) + which].rgb,
                       field[3 * (first + a.y * size.x + b.x) + which].rgb, t.x);
  const vec3 high = mix(field[3 * (first + b.y * size.x + a.x) + which].rgb,
                        field[3 * (first + b.y * size.x + b.x) + which].rgb, t.x);
  return mix(low, high, t.y);
}

// F_t, unpolarised (Born & Wolf, Principles of Optics, 1.5.2): what a plane surface lets through.
float transmittance(float mu_o, float mu_i, float eta) {
  const float s = (mu_o - eta * mu_i) / (mu_o + eta * mu_i);
  const float p = (eta * mu_o - mu_i) / (eta * mu_o + mu_i);
  return 1.0 - 0.5 * (s * s + p * p);
}

void main() {
  const vec2 pixel = (gl_FragCoord.xy + vec2(tile.origin)) / scene.optics.w;
  const vec3 ray = vec3(undistort((pixel - scene.focal.zw) / scene.focal.xy, undistorted), 1.0);
  const vec3 direction = ray.x * scene.camera_from_sample[0].xyz + ray.y * scene.camera_from_sample[1].xyz +
                         ray.z * scene.camera_from_sample[2].xyz;
  const FacePlane plane = plane_of(face);
  const float distance = (plane.at - scene.centre[plane.axis]) / direction[plane.axis];
  const vec3 hit = (scene.centre.xyz + distance * direction) / scene.spacing.xyz;  // in cells
  const vec2 at = vec2(hit[plane.u], hit[plane.v]);
  const ivec2 size = ivec2(scene.cells[plane.u], scene.cells[plane.v]);
  const vec2 slack = kRounding * distance * length(direction) / vec2(scene.spacing[plane.u], scene.spacing[plane.v]);
  if (any(lessThan(at, -slack)) || any(greaterThan(at, vec2(size) + slack)) || distance <= 0.0) discard;

  const float eta = scene.optics.y;
  const float mu_o = min(1.0, abs(direction[plane.axis]) / length(direction));
  const float mu_i = sqrt(1.0 - (1.0 - mu_o * mu_o) / (eta * eta));
  const vec3 inside = sample_field(at, size, 0) + 3.0 * mu_i * sample_field(at, size, 1);
  radiance = vec4(transmittance(mu_o, mu_i, eta) / (4.0 * kPi * eta * eta) * inside + sample_field(at, size, 2), 1.0);
}
