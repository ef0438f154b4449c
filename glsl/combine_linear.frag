#version 460
// Combine for files: the sum of light as it is, W/sr/m2.
#extension GL_GOOGLE_include_directive : require
#include "frame.glsl"
#include "images.glsl"
#include "radiance.glsl"

layout(location = 0) out vec4 combined;

void main() {
    combined = radiance(ivec2(gl_FragCoord.xy));
}
