#version 460
// Visibility of faces whose distance is that of their plane (scene::coplanar), in ascending rank.
#extension GL_GOOGLE_include_directive : require
#include "frame.glsl"
#include "scene.glsl"
#include "texture.glsl"
#include "position.glsl"

layout(location = 0) flat out uint face;
layout(location = 1) flat out vec4 plane; // normal; distance of the plane from the eye along it
layout(location = 2) out vec2 place; // where the mask is looked up, if there is one
layout(location = 3) flat out uint map_d;

void main() {
    uint index = uint(gl_VertexIndex) / 3u;
    uint corner = uint(gl_VertexIndex) % 3u;
    face = frame.coplanar.at[index].face;
    vec3 normal = frame.coplanar.at[index].normal;
    plane = vec4(normal, frame.coplanar.at[index].offset - dot(normal, frame.eye));
    uint triangle = face >> 1;
    map_d = material_map_d(triangle_material(triangle));
    place = map_d == NONE ? vec2(0.0) : placed(map_d, triangle_uv(triangle, corner));
    // The eye sees one side of a triangle; the other shrinks to a point.
    bool seen = frame.coplanar.at[index].towards * plane.w < 0.0;
    set_position(position_at(triangle_corner(triangle, seen ? corner : 0u)));
}
