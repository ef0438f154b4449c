#version 460
// Luminance of changed leaves without drawing them: each pixel finds its own.
#extension GL_GOOGLE_include_directive : require
#include "frame.glsl"
#include "images.glsl"
#include "barycentrics.glsl"
#include "luminance.glsl"
#include "lookup.glsl"

void main() {
    Found found = find();
    if (found.leaf == NONE) {
        discard;
    } else {
        write_found(found);
    }
}
