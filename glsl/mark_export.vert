#version 460
// Marks what a patch drew last with the reference of the patch.
#extension GL_GOOGLE_include_directive : require
#include "frame.glsl"
#include "position.glsl"

layout(location = 0) flat out uint reference;

void main() {
    reference = frame.mark_references.at[uint(gl_VertexIndex) / 3u];
    set_position(frame.marks.at[gl_VertexIndex]);
}
