#version 460
// Drawn triangles with the stencil references of their patches.
#extension GL_GOOGLE_include_directive : require
#include "frame.glsl"
#include "scene.glsl"
#include "position.glsl"
#include "drawn_vertex.glsl"

layout(location = 3) flat out uint reference;

void main() {
    set_drawn_vertex();
    reference = frame.list_references.at[uint(gl_VertexIndex) / 3u];
}
