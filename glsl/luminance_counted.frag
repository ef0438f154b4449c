#version 460
// The same, and the pixels of drawn triangles counted: after the tests, which must therefore come first.
#extension GL_GOOGLE_include_directive : require
#include "frame.glsl"
#include "luminance.glsl"
#include "drawn_fragment.glsl"
#include "drawn_pixels.glsl"

layout(early_fragment_tests) in;

void main() {
    count_pixel(drawn.y);
    write_drawn();
}
