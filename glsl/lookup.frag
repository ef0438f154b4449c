#version 460
// Luminance of changed drawn triangles without drawing them: each pixel finds its own.
#extension GL_GOOGLE_include_directive : require
#include "frame.glsl"
#include "scene.glsl"
#include "images.glsl"
#include "barycentrics.glsl"
#include "luminance.glsl"
#include "lookup.glsl"

void main() {
    Found found = find();
    if (found.drawn_id == NONE) {
        discard;
    } else {
        write_found(found);
    }
}
