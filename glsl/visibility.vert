#version 460
// Visibility: triangles without mask, vertices pulled by index (gl_PrimitiveID is broken in some drivers).
#extension GL_GOOGLE_include_directive : require
#include "frame.glsl"
#include "position.glsl"

layout(location = 0) flat out uint triangle;

void main() {
    uint drawn = uint(gl_VertexIndex) / 3u;
    triangle = frame.visibility_triangles.at[drawn].id;
    set_position(frame.positions.at[frame.visibility_triangles.at[drawn].corners[uint(gl_VertexIndex) % 3u]]);
}
