// What a normal map makes of the light of a slot (docs/method/reflection.md).

const float TAU = 6.28318531;

// bsdf::SpreadLight: integral of the product of two normalised spherical Gaussians whose axes have a cosine between them.
float product_of_gaussians(float a, float b, float cosine) {
    float lambda = a * b / max(a + b, 1e-30);
    float peak = lambda > 1e-3 ? lambda / (TAU * (1.0 - exp(-2.0 * lambda))) : 0.5 / TAU;
    return peak * exp(lambda * (cosine - 1.0));
}

// A GGX lobe about a normal over light spread about a direction, over its irradiance and the albedo.
float lobe_over_light(vec3 normal, vec3 to_eye, float alpha, vec3 axis, float sharpness) {
    float cosine = max(dot(normal, to_eye), 0.1);
    vec3 mirrored = reflect(-to_eye, normal);
    return product_of_gaussians(0.5 / (alpha * alpha * cosine), sharpness, dot(mirrored, axis)) / max(dot(normal, mirrored), 0.1);
}

// Turns weighted D and S of a face's pixel; `light` is the light vector over pi and the luminance of D, and |V|/fluence.
void turn(uint face, vec4 light, inout vec3 diffuse, inout vec3 specular) {
    uint triangle = face >> 1;
    Material m = material_at(triangle_material(triangle));
    if (m.map_normal == NONE) {
        return;
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
    float side = (face & 1u) == 1u ? -1.0 : 1.0;
    vec3 normal = shading_normal(triangle, at);
    vec3 texel = texture_filtered(m.map_normal, uv[0], uv[1] - uv[0], uv[2] - uv[0]);
    vec3 turned = mapped_normal(normal, edge1, edge2, d, e, texel, m.normal_scale) * side;
    normal *= side;
    float gain = max(1.0 + dot(light.xyz, turned - normal), 0.0);
    vec3 unturned = diffuse;
    diffuse *= gain;
    if (m.metallic < 0.0 || dot(light.xyz, light.xyz) == 0.0) {
        return;
    }
    float roughness = m.roughness;
    if (m.map_roughness != NONE) {
        roughness *= texture_filtered(m.map_roughness, uv[0], uv[1] - uv[0], uv[2] - uv[0]).g;
    }
    roughness = clamp(roughness, LEAST_ROUGHNESS, 1.0);
    float alpha = roughness * roughness;
    vec2 ndc = (gl_FragCoord.xy + frame.jitter) * frame.pixel - 1.0;
    vec3 to_eye = -normalize(frame.forward + frame.right * ndc.x + frame.down * ndc.y);
    float r = min(light.a, 0.9999);
    float sharpness = r * (3.0 - r * r) / (1.0 - r * r);
    vec3 axis = normalize(light.xyz);
    float before = lobe_over_light(normal, to_eye, alpha, axis, sharpness);
    float after = gain * lobe_over_light(turned, to_eye, alpha, axis, sharpness);
    specular = max(specular + (0.5 * TAU * (after - before)) * m.f0 * unturned, vec3(0.0));
}
