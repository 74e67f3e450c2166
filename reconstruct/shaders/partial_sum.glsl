// Sums one vec4 a thread over the workgroup, in a fixed order, and stores it as this workgroup's partial sum, `first`
// places further on; reduce.comp adds those up. Every thread of the workgroup must call it.
layout(std430, binding = PARTIAL_BINDING) writeonly buffer Partials { vec4 partials[]; };
shared vec4 workgroup_sum[128];

void store_partial_sum(vec4 value, int first) {
  const uint t = gl_LocalInvocationID.x;
  barrier();
  workgroup_sum[t] = value;
  for (uint half_width = 64; half_width > 0; half_width /= 2) {
    barrier();
    if (t < half_width) workgroup_sum[t] += workgroup_sum[t + half_width];
  }
  if (t == 0)
    partials[first + int(gl_WorkGroupID.y) * push.partial.y + push.partial.x + int(gl_WorkGroupID.x)] = workgroup_sum[0];
}
