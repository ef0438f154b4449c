#version 460
// Visibility of triangles with a cut-out mask.
#extension GL_GOOGLE_include_directive : require
#include "frame.glsl"
#include "texture.glsl"
#include "position.glsl"

layout(location = 0) flat out uint triangle;
layout(location = 1) out vec2 place; // where the mask is looked up
layout(location = 2) flat out uint map_d;

void main() {
    uint drawn = uint(gl_VertexIndex) / 3u;
    uint corner = uint(gl_VertexIndex) % 3u;
    triangle = frame.visibility_triangles.at[drawn].id;
    map_d = frame.materials.at[frame.triangles.at[triangle].material].map_d;
    place = placed(map_d, frame.triangles.at[triangle].uv[corner]);
    set_position(frame.positions.at[frame.visibility_triangles.at[drawn].corners[corner]]);
}
