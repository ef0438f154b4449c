#version 460
// Luminance: leaves of the dynamic mesh.
#extension GL_GOOGLE_include_directive : require
#include "frame.glsl"
#include "position.glsl"
#include "leaf_vertex.glsl"

void main() {
    set_leaf_vertex();
}
