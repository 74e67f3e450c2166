#version 450
#extension GL_GOOGLE_include_directive : require
// The radiance of a surface towards the camera, W/(mm^2 sr), and 1: the twin of render/scene/painter.cc.
//   translucent  F_t(mu_o) / (4 pi ior^2) (phi + 3 mu_i J_n);  opaque  rho / pi (sum of lights E (n.l) + pi L_env share)
//   measured     the same with rho = pi rho_s, on top of the translucent one's own
//   both         + sum of lights f_s E (n.l) + R(mu_o) L_env share
// Where painter.cc sends rays, lights are looked up in shadow maps, and what hides the mirrored environment is the share of
// the sky that the place sees.   set 0: as surface.vert
#include "raster.glsl"
layout(std140, set = 0, binding = 0) uniform Scene {
  vec4 eye;          // w: how many lights
  vec4 environment;  // radiance
  Light lights[96];  // kMostLights
};
layout(std430, set = 0, binding = 4) readonly buffer Maps { float nearest_depth[]; };  // one after another
layout(location = 0) in vec3 place;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec3 fluence;
layout(location = 3) in vec3 flux;
layout(location = 4) in vec2 sky_mark;
layout(location = 5) flat in vec4 optics;
layout(location = 6) in vec4 matte;  // w: radiance of marks
layout(location = 0) out vec4 radiance;

const float kPi = 3.14159265358979;
const float kGrazing = 0.02;
const float kTexelsOff = 1.5;   // a place is looked up so far above its surface: about what a texel spans
const float kDepthOff = 2e-5;   // and so much nearer to the light: rounding of 24 bits of depth
const float kUnseen = 1e-4;     // of what a place shows: less light than that is left out

float fresnel(float cosine, float ior) {
  const float square = 1.0 - (1.0 - cosine * cosine) / (ior * ior);
  const float inside = sqrt(max(0.0, square));
  const float s = (cosine - ior * inside) / (cosine + ior * inside);
  const float p = (ior * cosine - inside) / (ior * cosine + inside);
  return 0.5 * (s * s + p * p);
}

// The share of a light that comes through: of the four texels around a place, bilinear.
float lit(int k, vec3 n, float distance) {
  const int map = int(lights[k].position.w);
  if (map < 0) return 1.0;
  const float texel = lights[k].cone.z * (lights[k].along.w == 0.0 ? 1.0 : distance);
  const vec4 p = vec4(place + n * (kTexelsOff * texel), 1.0);
  const float w = dot(lights[k].map[3], p);
  const vec3 at = vec3(dot(lights[k].map[0], p), dot(lights[k].map[1], p), dot(lights[k].map[2], p)) / w;
  const int side = int(lights[k].cone.w);
  const int first = map * side * side;
  const vec2 where = (at.xy * 0.5 + 0.5) * side - 0.5;
  const ivec2 low = ivec2(floor(where));
  const vec2 share = where - low;
  float sum = 0.0;
  for (int k = 0; k < 4; ++k) {
    const ivec2 t = low + ivec2(k & 1, k >> 1);
    const bool within = all(greaterThanEqual(t, ivec2(0))) && all(lessThan(t, ivec2(side)));
    const float nearest = within ? nearest_depth[first + t.y * side + t.x] : 0.0;
    const float weight = ((k & 1) != 0 ? share.x : 1.0 - share.x) * ((k >> 1) != 0 ? share.y : 1.0 - share.y);
    if (at.z + kDepthOff >= nearest) sum += weight;
  }
  return sum;
}

// Irradiance on a surface across the light; `towards` it.
vec3 sample_light(int k, out vec3 towards, out float distance) {
  distance = 1e30;
  towards = -lights[k].along.xyz;
  if (lights[k].along.w == 0.0) return lights[k].strength.rgb;
  const vec3 way = lights[k].position.xyz - place;
  distance = length(way);
  towards = way / distance;
  float share = 1.0;
  if (lights[k].along.w == 2.0) {
    const float angle = acos(clamp(-dot(lights[k].along.xyz, towards), -1.0, 1.0));
    const float t = clamp((lights[k].cone.x - angle) / max(lights[k].cone.y, 1e-6), 0.0, 1.0);
    share = t * t * (3.0 - 2.0 * t);
  }
  if (lights[k].along.w == 3.0) share = max(0.0, -dot(lights[k].along.xyz, towards));
  return lights[k].strength.rgb * (share / (distance * distance));
}

float mirrored_share(vec3 n, vec3 l, vec3 v) {
  const float nl = dot(n, l);
  const float nv = dot(n, v);
  if (optics.z == 0.0 || optics.y == 1.0 || nl <= 0.0 || nv <= 0.0) return 0.0;
  const vec3 h = normalize(l + v);
  const float nh = min(1.0, dot(n, h));
  const float vh = min(1.0, dot(v, h));
  const float m2 = optics.w * optics.w;
  const float c2 = nh * nh;
  const float facets = exp(-(1.0 - c2) / (c2 * m2));
  const float f = fresnel(vh, optics.y);
  if (optics.z == 2.0) return f * facets / (4.0 * kPi * m2 * sqrt(nl * nv));
  const float hidden = min(1.0, min(2.0 * nh * nv / vh, 2.0 * nh * nl / vh));
  return facets / (kPi * m2 * c2 * c2) * hidden * f / (4.0 * nl * nv);
}

void main() {
  const bool translucent = optics.x > 0.0;
  if (sky_mark.y > 0.5) {
    radiance = vec4(matte.w, 0.0, matte.w, 1.0);
    return;
  }
  const vec3 v = normalize(eye.xyz - place);
  vec3 n = normalize(normal);
  if (!translucent && !gl_FrontFacing) n = -n;
  const float off = dot(n, v);
  if (off < kGrazing) n = normalize(n + v * (kGrazing - off));
  const float cosine = min(1.0, dot(n, v));
  const float ior = optics.y;
  vec3 sum = matte.rgb * environment.rgb * sky_mark.x;
  if (translucent) {
    const float inside = sqrt(max(0.0, 1.0 - (1.0 - cosine * cosine) / (ior * ior)));
    sum += max(vec3(0.0), fluence + 3.0 * inside * flux) * ((1.0 - fresnel(cosine, ior)) / (4.0 * kPi * ior * ior));
  }
  for (int k = 0; k < int(eye.w); ++k) {
    vec3 l;
    float distance;
    const vec3 e = sample_light(k, l, distance);
    const float nl = dot(n, l);
    if (nl <= 0.0 || max(e.r, max(e.g, e.b)) <= 0.0) continue;
    const vec3 more = (matte.rgb / kPi + mirrored_share(n, l, v)) * e * nl;
    if (all(lessThanEqual(more, kUnseen * sum))) continue;
    sum += more * lit(k, n, distance);
  }
  if (optics.z != 0.0 && ior != 1.0) sum += environment.rgb * (fresnel(cosine, ior) * sky_mark.x);
  radiance = vec4(sum, 1.0);
}
