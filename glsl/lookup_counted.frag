#version 460
// The same, and the pixels of drawn triangles counted.
#extension GL_GOOGLE_include_directive : require
#include "frame.glsl"
#include "scene.glsl"
#include "images.glsl"
#include "barycentrics.glsl"
#include "luminance.glsl"
#include "lookup.glsl"
#include "drawn_pixels.glsl"

void main() {
    Found found = find();
    if (found.drawn_id == NONE) {
        discard;
    } else {
        count_pixel(found.drawn_id);
        write_found(found);
    }
}
