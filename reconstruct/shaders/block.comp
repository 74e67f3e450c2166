#version 450
#extension GL_GOOGLE_include_directive : require
// Adds up the workgroups' sums of each slot, or takes the largest, into the block that the processor reads.
//
// set 0: 0 sums, [slot][workgroup] (read), 1 block (write)
// Size: one workgroup of 128 a slot, two sums a thread.
#define SUMS_BINDING 0
layout(local_size_x = 128) in;
#include "sums.glsl"
#include "slots.glsl"
layout(std430, binding = 1) writeonly buffer Block { vec2 block[]; };
layout(push_constant) uniform Push { int first; } push;

void main() {
  const int slot = push.first + int(gl_WorkGroupID.x);
  const bool largest = slot == kMove || slot == kLargest;
  const uint t = gl_LocalInvocationID.x;
  const vec2 a = sums[slot * kSumGroups + t];
  const vec2 b = sums[slot * kSumGroups + t + 128];
  workgroup_pair[t] = largest ? max(a, b) : two_sum(a, b);
  for (uint half_width = 64; half_width > 0; half_width /= 2) {
    barrier();
    const vec2 other = workgroup_pair[min(t + half_width, 127)];
    if (t < half_width) workgroup_pair[t] = largest ? max(workgroup_pair[t], other) : two_sum(workgroup_pair[t], other);
  }
  if (t == 0) block[slot] = workgroup_pair[0];
}
