#version 460
// Background gets a depth, so that pixels without any are those of faces that no drawn triangle covers.
#extension GL_GOOGLE_include_directive : require
#include "images.glsl"

void main() {
    if (texelFetch(ids, ivec2(gl_FragCoord.xy), 0).x != 0u) {
        discard;
    }
}
