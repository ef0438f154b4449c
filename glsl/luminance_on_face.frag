#version 460
// Luminance where the id image shows this very face: patch updates without depth, and cut-outs.
#extension GL_GOOGLE_include_directive : require
#include "frame.glsl"
#include "images.glsl"
#include "luminance.glsl"
#include "drawn_fragment.glsl"

void main() {
    if (texelFetch(ids, ivec2(gl_FragCoord.xy), 0).x != drawn.x + 1u) {
        discard;
    }
    write_drawn();
}
