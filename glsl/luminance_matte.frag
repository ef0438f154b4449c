#version 460
// luminance.frag where nothing has highlights.
#extension GL_GOOGLE_include_directive : require
#define MATTE
#include "frame.glsl"
#include "luminance.glsl"
#include "drawn_fragment.glsl"

void main() {
    write_drawn();
}
