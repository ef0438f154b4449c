// Light as displayed: exposure, tone mapping, sRGB.
vec4 displayed(vec4 light) {
    return vec4(srgb_from_linear(tone_map(finite(light.rgb * frame.exposure))), light.a);
}
