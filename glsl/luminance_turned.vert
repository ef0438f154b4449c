#version 460
// luminance.vert where normal maps turn the light.
#extension GL_GOOGLE_include_directive : require
#define TURNED
#include "frame.glsl"
#include "scene.glsl"
#include "position.glsl"
#include "drawn_vertex.glsl"

void main() {
    set_drawn_vertex();
}
