#version 460
// The same, and the pixels of leaves counted: for draws that the depth test lets all pass.
#extension GL_GOOGLE_include_directive : require
#include "frame.glsl"
#include "images.glsl"
#include "luminance.glsl"
#include "leaf_fragment.glsl"
#include "leaf_pixels.glsl"

void main() {
    if (texelFetch(ids, ivec2(gl_FragCoord.xy), 0).x != face + 1u) {
        discard;
    }
    count_pixel(leaf);
    write_luminance(weighted_diffuse, weighted_specular, weight, leaf);
}
