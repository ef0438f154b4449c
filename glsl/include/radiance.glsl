// L = L_e + k_d D + k_s S of a pixel (method.md 2), W/sr/m2; a is the coverage.
vec4 radiance(ivec2 p) {
    vec4 kd = texelFetch(image_kd, p, 0);
    vec3 ks = texelFetch(image_ks, p, 0).rgb;
    vec3 emission = texelFetch(image_emission, p, 0).rgb / frame.emission_scale;
    vec3 diffuse = texelFetch(image_diffuse, p, 0).rgb;
    vec3 specular = texelFetch(image_specular, p, 0).rgb;
    return vec4(emission + (kd.rgb * diffuse + ks * specular) / frame.luminance_scale, kd.a);
}
