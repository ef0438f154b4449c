// L = L_e + k_d D + k_s S of a pixel (docs/method/what-a-pixel-shows.md), W/sr/m2; a is the coverage.

layout(constant_id = 3) const bool HIGHLIGHTS = true; // whether anything has them (src/pass/needs.rs)

// D and S of a pixel, times the luminance scale.
struct Luminance {
    vec3 diffuse;
    vec3 specular;
};

Luminance luminance_at(ivec2 p) {
    vec3 specular = HIGHLIGHTS ? texelFetch(image_specular, p, 0).rgb : vec3(0.0);
    return Luminance(texelFetch(image_diffuse, p, 0).rgb, specular);
}

vec4 radiance(ivec2 p, Luminance light) {
    vec4 kd = texelFetch(image_kd, p, 0);
    vec3 ks = HIGHLIGHTS ? texelFetch(image_ks, p, 0).rgb : vec3(0.0);
    vec3 emission = texelFetch(image_emission, p, 0).rgb / frame.emission_scale;
    return vec4(emission + (kd.rgb * light.diffuse + ks * light.specular) / frame.luminance_scale, kd.a);
}
