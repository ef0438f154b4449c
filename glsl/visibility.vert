#version 460
// Visibility: triangles without mask, vertices pulled by index (gl_PrimitiveID is broken in some drivers).
#extension GL_GOOGLE_include_directive : require
#include "frame.glsl"
#include "scene.glsl"
#include "position.glsl"

layout(location = 0) flat out uint triangle;

void main() {
    uint index = uint(gl_VertexIndex) / 3u;
    triangle = visibility_triangle_id(index);
    set_position(position_at(visibility_triangle_corner(index, uint(gl_VertexIndex) % 3u)));
}
