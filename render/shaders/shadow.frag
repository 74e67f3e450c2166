#version 450
// The depth of what is nearest to the light: 1 near, 0 far, and 0 where there is nothing.
layout(location = 0) out vec4 depth;

void main() { depth = vec4(gl_FragCoord.z, 0.0, 0.0, 0.0); }
