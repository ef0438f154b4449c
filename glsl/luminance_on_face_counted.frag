#version 460
// The same, and the pixels of drawn triangles counted: for draws that the depth test lets all pass.
#extension GL_GOOGLE_include_directive : require
#include "frame.glsl"
#include "images.glsl"
#include "luminance.glsl"
#include "drawn_fragment.glsl"
#include "drawn_pixels.glsl"

void main() {
    if (texelFetch(ids, ivec2(gl_FragCoord.xy), 0).x != drawn.x + 1u) {
        discard;
    }
    count_pixel(drawn.y);
    write_drawn();
}
