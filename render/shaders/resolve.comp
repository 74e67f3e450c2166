#version 450
// A pixel is the mean of its samples, s x s on a regular grid: what a sensor's pixel sees.
//   set 0: 0 samples (read), s width x s height RGBA; 1 pixels (write), width x height RGBA
layout(local_size_x = 128) in;  // pixels of a tile in a row; lavapipe is at its best with 64 and more
layout(std430, binding = 0) readonly buffer Samples { vec4 samples[]; };
layout(std430, binding = 1) writeonly buffer Pixels { vec4 pixels[]; };
layout(push_constant) uniform Push { uint width; uint height; uint s; };
void main() {
  const uint i = gl_GlobalInvocationID.x;
  if (i >= width * height) return;
  const uvec2 corner = uvec2(i % width, i / width) * s;
  vec4 sum = vec4(0);
  for (uint y = 0; y < s; ++y)
    for (uint x = 0; x < s; ++x) sum += samples[(corner.y + y) * width * s + corner.x + x];
  pixels[i] = sum / float(s * s);
}
