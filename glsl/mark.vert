#version 460
// Marks what a patch drew last: the same corners in the same order, so that depth EQUAL holds.
#extension GL_GOOGLE_include_directive : require
#include "frame.glsl"
#include "position.glsl"

void main() {
    set_position(frame.marks.at[gl_VertexIndex]);
}
