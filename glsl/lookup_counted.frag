#version 460
// The same, and the pixels of leaves counted.
#extension GL_GOOGLE_include_directive : require
#include "frame.glsl"
#include "images.glsl"
#include "barycentrics.glsl"
#include "luminance.glsl"
#include "lookup.glsl"
#include "leaf_pixels.glsl"

void main() {
    Found found = find();
    if (found.leaf == NONE) {
        discard;
    } else {
        count_pixel(found.leaf);
        write_found(found);
    }
}
