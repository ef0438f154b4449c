#version 460
// luminance.frag where normal maps turn the light.
#extension GL_GOOGLE_include_directive : require
#define TURNED
#include "frame.glsl"
#include "scene.glsl"
#include "texture.glsl"
#include "barycentrics.glsl"
#include "normals.glsl"
#include "luminance.glsl"
#include "drawn_fragment.glsl"

void main() {
    write_drawn();
}
