#version 450
// Takes its time: `rounds` steps of a linear congruential generator, whose last state is the result.
layout(local_size_x = 1) in;  // one thread, so that it is slow
layout(std430, binding = 0) buffer State { uint state[]; };
layout(push_constant) uniform Push { uint rounds; };
void main() {
  uint x = state[0];
  for (uint i = 0; i < rounds; ++i) x = x * 1664525u + 1013904223u + (x >> 16);
  state[0] = x;
}
