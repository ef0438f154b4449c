#version 460
// Visibility of triangles with a cut-out mask.
#extension GL_GOOGLE_include_directive : require
#include "frame.glsl"
#include "scene.glsl"
#include "texture.glsl"
#include "position.glsl"

layout(location = 0) flat out uint triangle;
layout(location = 1) out vec2 place; // where the mask is looked up
layout(location = 2) flat out uint map_d;

void main() {
    uint index = uint(gl_VertexIndex) / 3u;
    uint corner = uint(gl_VertexIndex) % 3u;
    triangle = visibility_triangle_id(index);
    map_d = material_map_d(triangle_material(triangle));
    place = placed(map_d, triangle_uv(triangle, corner));
    set_position(position_at(visibility_triangle_corner(index, corner)));
}
