#version 460
// Combine for pixels that no drawn triangle covers.
#extension GL_GOOGLE_include_directive : require
#include "frame.glsl"
#include "images.glsl"
#include "radiance.glsl"
#include "uncovered.glsl"
#include "tone_mapping.glsl"
#include "display.glsl"

layout(location = 0) out vec4 display;

void main() {
    ivec2 p = ivec2(gl_FragCoord.xy);
    display = displayed(radiance(p, luminance_around(p)));
}
