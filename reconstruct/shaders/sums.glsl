// Sums that are read on the processor in more than float32: each a pair (high, low) by Knuth's two-sum, first by thread,
// then over the workgroup, then over the workgroups in block.comp; all in a fixed order. A kernel that sums runs in
// exactly kSumGroups workgroups and walks its data in steps of kSumThreads.
const int kSumGroups = 256;
const int kSumThreads = 128 * kSumGroups;
layout(std430, binding = SUMS_BINDING) buffer Sums { vec2 sums[]; };  // [slot][workgroup]
shared vec2 workgroup_pair[128];

vec2 two_sum(vec2 a, vec2 b) {
  precise float sum = a.x + b.x;
  precise float part = sum - a.x;
  precise float lost = (a.x - (sum - part)) + (b.x - part);
  precise float low = a.y + b.y + lost;
  return vec2(sum, low);
}
vec2 add_to(vec2 sum, float value) { return two_sum(sum, vec2(value, 0)); }

// Every thread of the workgroup must call these.
void store_sum(int slot, vec2 value, bool afresh) {
  const uint t = gl_LocalInvocationID.x;
  barrier();
  workgroup_pair[t] = value;
  for (uint half_width = 64; half_width > 0; half_width /= 2) {
    barrier();
    if (t < half_width) workgroup_pair[t] = two_sum(workgroup_pair[t], workgroup_pair[t + half_width]);
  }
  if (t > 0) return;
  const int at = slot * kSumGroups + int(gl_WorkGroupID.x);
  sums[at] = afresh ? workgroup_pair[0] : two_sum(sums[at], workgroup_pair[0]);
}
void store_largest(int slot, float value) {
  const uint t = gl_LocalInvocationID.x;
  barrier();
  workgroup_pair[t].x = value;
  for (uint half_width = 64; half_width > 0; half_width /= 2) {
    barrier();
    if (t < half_width) workgroup_pair[t].x = max(workgroup_pair[t].x, workgroup_pair[t + half_width].x);
  }
  if (t == 0) sums[slot * kSumGroups + int(gl_WorkGroupID.x)] = vec2(workgroup_pair[0].x, 0);
}
