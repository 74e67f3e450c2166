#version 450
// The colour of the layer, from the buffer.   set 0: 0 colours, one vec4 a layer
layout(location = 0) flat in int layer;
layout(location = 0) out vec4 color;
layout(std430, binding = 0) readonly buffer Colors { vec4 colors[]; };
void main() { color = colors[layer]; }
