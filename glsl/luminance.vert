#version 460
// Luminance: drawn triangles of the dynamic mesh.
#extension GL_GOOGLE_include_directive : require
#include "frame.glsl"
#include "position.glsl"
#include "drawn_vertex.glsl"

void main() {
    set_drawn_vertex();
}
