// What luminance.vert sends of a drawn triangle.
layout(location = 0) in vec4 weighted_diffuse; // a: the weight
layout(location = 1) flat in uvec2 drawn; // face, id
#ifdef MATTE
const vec3 weighted_specular = vec3(0.0);
#else
layout(location = 2) in vec3 weighted_specular;
#endif

#ifdef TURNED // by normal maps
layout(location = 3) in vec3 weighted_light;

// What D counts times on a surface of the pixel's own normal: the light vector's component along it, over that along the shading normal,
// which is 1 (docs/method/reflection.md).
float turning(uint face) {
    uint triangle = face >> 1;
    Material m = material_at(triangle_material(triangle));
    if (m.map_normal == NONE) {
        return 1.0;
    }
    uvec3 corners = triangle_corners(triangle);
    vec3 a = position_at(corners.x);
    vec3 edge1 = position_at(corners.y) - a;
    vec3 edge2 = position_at(corners.z) - a;
    vec2 uv_a = triangle_uv(triangle, 0u);
    vec2 d = triangle_uv(triangle, 1u) - uv_a;
    vec2 e = triangle_uv(triangle, 2u) - uv_a;
    vec2 uv[3];
    vec2 steps[3] = vec2[3](vec2(0.0), vec2(frame.filter_width, 0.0), vec2(0.0, frame.filter_width));
    vec2 at = vec2(0.0);
    for (int i = 0; i < 3; ++i) {
        vec2 b = barycentrics(a, edge1, edge2, gl_FragCoord.xy + frame.jitter + steps[i]);
        uv[i] = uv_a + d * b.x + e * b.y;
        at = i == 0 ? b : at;
    }
    vec3 normal = shading_normal(triangle, at);
    vec3 texel = texture_filtered(m.map_normal, uv[0], uv[1] - uv[0], uv[2] - uv[0]);
    vec3 turned = mapped_normal(normal, edge1, edge2, d, e, texel, m.normal_scale);
    vec3 light = weighted_light / max(weighted_diffuse.a, LEAST_WEIGHT);
    float side = (face & 1u) == 1u ? -1.0 : 1.0;
    return max(1.0 + side * dot(light, turned - normal), 0.0);
}
#endif

void write_drawn() {
#ifdef TURNED
    vec3 diffuse = weighted_diffuse.rgb * turning(drawn.x);
#else
    vec3 diffuse = weighted_diffuse.rgb;
#endif
    write_luminance(diffuse, weighted_specular, weighted_diffuse.a, drawn.y);
}
