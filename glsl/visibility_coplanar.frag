#version 460
// Visibility of faces whose distance is that of their plane: equal to the bit for all faces of it, so that the later drawn is seen.
#extension GL_GOOGLE_include_directive : require
#include "frame.glsl"
#include "scene.glsl"
#include "texture.glsl"

layout(location = 0) flat in uint face;
layout(location = 1) flat in vec4 plane;
layout(location = 2) in vec2 place;
layout(location = 3) flat in uint map_d;
layout(location = 0) out uint id;

void main() {
    if (map_d != NONE && !is_opaque(map_d, place)) {
        discard;
    }
    vec2 ndc = (gl_FragCoord.xy + frame.jitter) * frame.pixel - 1.0;
    vec3 direction = frame.forward + frame.right * ndc.x + frame.down * ndc.y;
    gl_FragDepth = frame.depth_of_inverse.x * dot(plane.xyz, direction) / plane.w + frame.depth_of_inverse.y;
    id = face + 1u;
}
