#version 460
// Luminance of every fragment that passes the depth and stencil tests.
#extension GL_GOOGLE_include_directive : require
#include "frame.glsl"
#include "luminance.glsl"
#include "drawn_fragment.glsl"

void main() {
    write_drawn();
}
