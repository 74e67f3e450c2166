#version 450
// y_i += a x_i, i < n.   set 0: 0 x (read), 1 y (read and write)
layout(local_size_x = 128) in;  // lavapipe is at its best with 64 and more
layout(std430, binding = 0) readonly buffer X { float x[]; };
layout(std430, binding = 1) buffer Y { float y[]; };
layout(push_constant) uniform Push { uint n; float a; };
void main() {
  const uint i = gl_GlobalInvocationID.x;
  if (i < n) y[i] += a * x[i];
}
