#version 450
#extension GL_GOOGLE_include_directive : require
// What a lit or seen face adds to -a sum psi phi of its cells: sum r (phi - S) + a psi S, over the illuminations.
//                                                                  (reconstruct/gradient.h; r only seen and not along rays, S only lit)
// set 0: 0 q of the lit face, 1 r, 2 phi, 3 psi (read), 4 the face's terms (read and write)
// Size: one thread a cell of the face, 128 along it, over all groups.
#include "model.glsl"
layout(std430, binding = 0) readonly buffer Irradiance { vec4 irradiance[]; };
layout(std430, binding = 1) readonly buffer Rims { vec4 rim[]; };
layout(std430, binding = 2) readonly buffer Phi { vec4 phi[]; };
layout(std430, binding = 3) readonly buffer Psi { vec4 psi[]; };
layout(std430, binding = 4) buffer Terms { float terms[]; };

void main() {
  const int f = int(gl_GlobalInvocationID.x);
  if (f >= face_count()) return;
  const int cell = cell_behind(f);
  const float area = area_of(face_axis());
  float sum = has(kFirst) ? 0.0 : terms[f];
  for (int group = 0; group < push.face.y; ++group) {
    const int at = group * push.cells.w + cell;
    const int n = group * face_count() + f;
    vec4 source = vec4(0);
    if (has(kLit) && !has(kCollimated)) source = push.surface.y * irradiance[n];
    sum += area * dot(psi[at], source);
    if (has(kSeen) && !has(kAlongRays)) sum += dot(rim[n], phi[at] - source);
  }
  terms[f] = sum;
}
