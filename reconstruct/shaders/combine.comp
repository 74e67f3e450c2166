#version 450
#extension GL_GOOGLE_include_directive : require
// d += sum_k f_k v_k on the free parameters, from f g~ where the direction starts, and max |d|
//                                                                       (reconstruct/lbfgs_space.h, LbfgsDirection)
// set 0: 0 x, 1 g, 2 to 5 four vectors (read), 6 d (read and write), 7 sums
// Size: kSumGroups workgroups over the parameters.
#define SUMS_BINDING 7
#include "vectors.glsl"
#include "sums.glsl"
#include "slots.glsl"
layout(std430, binding = 0) readonly buffer X { float x[]; };
layout(std430, binding = 1) readonly buffer G { float g[]; };
layout(std430, binding = 2) readonly buffer V0 { float v0[]; };
layout(std430, binding = 3) readonly buffer V1 { float v1[]; };
layout(std430, binding = 4) readonly buffer V2 { float v2[]; };
layout(std430, binding = 5) readonly buffer V3 { float v3[]; };
layout(std430, binding = 6) buffer D { float d[]; };

void main() {
  float largest = 0.0;
  for (int i = int(gl_GlobalInvocationID.x); i < push.size.x; i += kSumThreads) {
    const float free = free_part(i, x[i], g[i]);
    float value = push.size.z != 0 ? push.step.x * free : d[i];
    value += dot(push.factors, vec4(v0[i], v1[i], v2[i], v3[i]));
    if (free == 0.0) value = 0.0;
    d[i] = value;
    largest = max(largest, abs(value));
  }
  store_largest(kMove, largest);
}
