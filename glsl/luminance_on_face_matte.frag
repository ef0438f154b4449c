#version 460
// luminance_on_face.frag where nothing has highlights.
#extension GL_GOOGLE_include_directive : require
#define MATTE
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
