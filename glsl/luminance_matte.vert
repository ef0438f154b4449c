#version 460
// luminance.vert where nothing has highlights.
#extension GL_GOOGLE_include_directive : require
#define MATTE
#include "frame.glsl"
#include "scene.glsl"
#include "position.glsl"
#include "drawn_vertex.glsl"

void main() {
    set_drawn_vertex();
}
