// Shading normals, scene::Scene::shading_normal_at and mapped_normal.
#extension GL_EXT_buffer_reference_uvec2 : require

layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Normals { vec3 at[]; };

// The unit shading normal of the front side at barycentric weights of corners 1 and 2.
vec3 shading_normal(uint triangle, vec2 b) {
    Normals of = Normals(frame.normals);
    uint first = 3u * triangle;
    return normalize(of.at[first] * (1.0 - b.x - b.y) + of.at[first + 1u] * b.x + of.at[first + 2u] * b.y);
}

// The normal of a normal map in place of a shading normal, of a triangle of these edges and of these rises of uv along them; `texel` in [0, 1].
vec3 mapped_normal(vec3 normal, vec3 edge1, vec3 edge2, vec2 d, vec2 e, vec3 texel, float scale) {
    vec3 turned = texel * 2.0 - 1.0;
    float side = d.x * e.y - d.y * e.x < 0.0 ? -1.0 : 1.0;
    vec3 rise = (edge1 * e.y - edge2 * d.y) * side;
    vec3 right = rise - normal * dot(normal, rise);
    if (dot(right, right) == 0.0) {
        return normal;
    }
    right = normalize(right);
    vec3 up = cross(normal, right) * side;
    return normalize(right * (turned.x * scale) + up * (turned.y * scale) + normal * turned.z);
}
