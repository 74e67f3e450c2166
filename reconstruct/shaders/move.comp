#version 450
#extension GL_GOOGLE_include_directive : require
// x' = P(x + alpha d), d shortened to the largest move allowed; P: into the box.
//
// set 0: 0 x, 1 d, 2 block, for max |d| (read), 3 x' (write)
// Size: one thread a parameter, 128 along x.
#include "vectors.glsl"
#include "slots.glsl"
layout(std430, binding = 0) readonly buffer X { float x[]; };
layout(std430, binding = 1) readonly buffer D { float d[]; };
layout(std430, binding = 2) readonly buffer Block { vec2 block[]; };
layout(std430, binding = 3) writeonly buffer Moved { float moved[]; };

void main() {
  const int i = int(gl_GlobalInvocationID.x);
  if (i >= push.size.x) return;
  const float move = block[kMove].x;
  const float shorter = move > push.step.z ? push.step.z / move : 1.0;
  const vec2 box = i < push.size.y ? push.bounds.xy : push.bounds.zw;
  moved[i] = clamp(x[i] + push.step.y * shorter * d[i], box.x, box.y);
}
