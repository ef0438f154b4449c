#version 460
// Luminance where the stencil holds the drawn triangle's own reference.
#extension GL_ARB_shader_stencil_export : require
#extension GL_GOOGLE_include_directive : require
#include "frame.glsl"
#include "luminance.glsl"
#include "drawn_fragment.glsl"

layout(location = 3) flat in uint reference;

void main() {
    gl_FragStencilRefARB = int(reference);
    write_drawn();
}
