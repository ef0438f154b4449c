#version 460
// Combine: exposure, tone mapping and sRGB over the sum of light.
#extension GL_GOOGLE_include_directive : require
#include "frame.glsl"
#include "images.glsl"
#include "radiance.glsl"
#include "tone_mapping.glsl"

layout(location = 0) out vec4 display;

void main() {
    vec4 light = radiance(ivec2(gl_FragCoord.xy));
    display = vec4(srgb_from_linear(tone_map(finite(light.rgb * frame.exposure), frame.tone_mapping)), light.a);
}
