#version 460
// One triangle that covers the image, at the depth of the background.
#extension GL_GOOGLE_include_directive : require
#include "frame.glsl"

void main() {
    vec2 corner = vec2(gl_VertexIndex == 1 ? 3.0 : -1.0, gl_VertexIndex == 2 ? 3.0 : -1.0);
    gl_Position = vec4(corner, frame.background_depth, 1.0);
}
