#version 460
// Luminance: corners of the drawn triangles of this draw.
#extension GL_GOOGLE_include_directive : require
#include "frame.glsl"
#include "scene.glsl"
#include "position.glsl"
#include "drawn_vertex.glsl"

void main() {
    set_drawn_vertex();
}
