#version 450
// Radiance as 8 bits of sRGB (IEC 61966-2-1) over a background: display = L gain, then coverage.
//   set 0: 0 pixels (read) RGBA, 1 display (write), 8 bits each of red, green, blue, 255; one pixel an invocation
layout(local_size_x = 128) in;
layout(std430, set = 0, binding = 0) readonly buffer Pixels { vec4 pixels[]; };
layout(std430, set = 0, binding = 1) writeonly buffer Display { uint display[]; };
layout(push_constant) uniform Tone { vec3 background; float gain; uint count; };

vec3 srgb(vec3 x) {
  return mix(12.92 * x, 1.055 * pow(x, vec3(1.0 / 2.4)) - 0.055, greaterThan(x, vec3(0.0031308)));
}

void main() {
  const uint i = gl_GlobalInvocationID.x;
  if (i >= count) return;
  const vec4 pixel = pixels[i];
  const vec3 shown = min(pixel.rgb * gain, vec3(pixel.a)) + (1.0 - pixel.a) * background;
  display[i] = packUnorm4x8(vec4(srgb(clamp(shown, 0.0, 1.0)), 1.0));
}
