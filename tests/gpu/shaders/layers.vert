#version 450
// Two triangles over the lower left half of the target: vertices 0-2 at depth 0.75 (near), 3-5 at 0.25 (far).
layout(location = 0) flat out int layer;
void main() {
  const vec2 corner = vec2[](vec2(-1, -1), vec2(-1, 1), vec2(1, 1))[gl_VertexIndex % 3];
  layer = gl_VertexIndex / 3;
  gl_Position = vec4(corner, layer == 0 ? 0.75 : 0.25, 1);
}
