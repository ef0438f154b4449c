#version 460
// Visibility of triangles with a cut-out mask: what is cut out is not there.
#extension GL_GOOGLE_include_directive : require
#include "frame.glsl"
#include "scene.glsl"
#include "texture.glsl"

layout(location = 0) flat in uint triangle;
layout(location = 1) in vec2 place;
layout(location = 2) flat in uint map_d;
layout(location = 0) out uint id;

void main() {
    if (!is_opaque(map_d, place)) {
        discard;
    }
    id = (triangle << 1 | (gl_FrontFacing ? 0u : 1u)) + 1u;
}
