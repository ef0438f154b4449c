#version 460
// Combine for files: the sum of light as it is, W/sr/m2, and D and S without holes.
#extension GL_GOOGLE_include_directive : require
#include "frame.glsl"
#include "images.glsl"
#include "radiance.glsl"
#include "uncovered.glsl"

layout(location = 0) out vec4 combined;
layout(location = 1) out vec4 diffuse;
layout(location = 2) out vec4 specular;

void main() {
    ivec2 p = ivec2(gl_FragCoord.xy);
    Luminance light = luminance_around(p);
    combined = radiance(p, light);
    diffuse = vec4(light.diffuse, 1.0);
    specular = vec4(light.specular, 1.0);
}
