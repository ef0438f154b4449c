#version 460
// Visibility: face id + 1, a face being a side of a triangle.
#extension GL_GOOGLE_include_directive : require
layout(location = 0) flat in uint triangle;
layout(location = 0) out uint id;

void main() {
    id = (triangle << 1 | (gl_FrontFacing ? 0u : 1u)) + 1u;
}
