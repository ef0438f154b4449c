#version 460
// The reference that a marking triangle writes to the stencil.
#extension GL_ARB_shader_stencil_export : require

layout(location = 0) flat in uint reference;

void main() {
    gl_FragStencilRefARB = int(reference);
}
