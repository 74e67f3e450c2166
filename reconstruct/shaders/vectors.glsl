// Vectors of the minimisation: log sigma_s' of every cell, then log sigma_a (reconstruct/vulkan/device_space.h).
layout(local_size_x = 128) in;
layout(push_constant) uniform Push {
  ivec4 size;    // parameters; cells; whether the direction starts here; first slot
  vec4 bounds;   // log sigma_s' from, to; log sigma_a from, to
  vec4 factors;  // of the vectors at hand
  vec4 step;     // factor of g~; alpha; largest move
} push;

// g~: the gradient, 0 where descent would push a parameter through its bound
float free_part(int i, float x, float g) {
  const vec2 box = i < push.size.y ? push.bounds.xy : push.bounds.zw;
  return (x <= box.x && g > 0.0) || (x >= box.y && g < 0.0) ? 0.0 : g;
}
