#version 460
// luminance_on_face.frag where normal maps turn the light.
#extension GL_GOOGLE_include_directive : require
#define TURNED
#include "frame.glsl"
#include "scene.glsl"
#include "images.glsl"
#include "texture.glsl"
#include "barycentrics.glsl"
#include "normals.glsl"
#include "luminance.glsl"
#include "drawn_fragment.glsl"

void main() {
    if (texelFetch(ids, ivec2(gl_FragCoord.xy), 0).x != drawn.x + 1u) {
        discard;
    }
    write_drawn();
}
