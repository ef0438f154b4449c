// Tone mapping of scene::ToneMapping; image::tone_mapping is the same on the CPU, and a test compares the two.
const uint CLAMP = 0u;
const uint REINHARD = 1u;
const uint ACES = 2u;
const uint AGX = 3u;
const uint PBR_NEUTRAL = 4u;

const float MAX_INPUT = 1e6; // bounds the squares of the fits

// Not a number and less than nothing count as black.
vec3 finite(vec3 c) {
    return mix(vec3(0.0), min(c, MAX_INPUT), greaterThan(c, vec3(0.0)));
}

vec3 reinhard(vec3 c) {
    return c / (1.0 + dot(c, vec3(0.2126, 0.7152, 0.0722)));
}

// Narkowicz's fit of the ACES filmic curve, a channel at a time.
vec3 aces(vec3 c) {
    return c * (2.51 * c + 0.03) / (c * (2.43 * c + 0.59) + 0.14);
}

// AgX, base look, in Wrensch's minimal form (inset, sixth-degree contrast curve, outset, 2.2 display).
vec3 agx(vec3 c) {
    const mat3 inset = mat3(0.842479062253094, 0.0423282422610123, 0.0423756549057051,
                            0.0784335999999992, 0.878468636469772, 0.0784336,
                            0.0792237451477643, 0.0791661274605434, 0.879142973793104);
    const mat3 outset = mat3(1.19687900512017, -0.0528968517574562, -0.0529716355144438,
                             -0.0980208811401368, 1.15190312990417, -0.0980434501171241,
                             -0.0990297440797205, -0.0989611768448433, 1.15107367264116);
    const float min_ev = -12.47393;
    const float max_ev = 4.026069;
    vec3 x = (clamp(log2(max(inset * c, 1e-10)), min_ev, max_ev) - min_ev) / (max_ev - min_ev);
    vec3 x2 = x * x;
    vec3 x4 = x2 * x2;
    vec3 y = 15.5 * x4 * x2 - 40.14 * x4 * x + 31.96 * x4 - 6.868 * x2 * x + 0.4298 * x2 + 0.1191 * x - 0.00232;
    return pow(max(outset * y, 0.0), vec3(2.2));
}

// Khronos PBR Neutral, after its reference implementation.
vec3 pbr_neutral(vec3 c) {
    const float start = 0.8 - 0.04;
    const float desaturation = 0.15;
    float low = min(c.r, min(c.g, c.b));
    c -= low < 0.08 ? low - 6.25 * low * low : 0.04;
    float peak = max(c.r, max(c.g, c.b));
    if (peak < start) {
        return c;
    }
    const float d = 1.0 - start;
    float new_peak = 1.0 - d * d / (peak + d - start);
    float grey = 1.0 - 1.0 / (desaturation * (peak - new_peak) + 1.0);
    return mix(c * (new_peak / peak), vec3(new_peak), grey);
}

layout(constant_id = 1) const uint OPERATOR = CLAMP; // one of the above: a rasteriser on the CPU runs all branches of a switch

vec3 tone_map(vec3 c) {
    switch (OPERATOR) {
        case REINHARD: return reinhard(c);
        case ACES: return aces(c);
        case AGX: return agx(c);
        case PBR_NEUTRAL: return pbr_neutral(c);
        default: return c;
    }
}

vec3 srgb_from_linear(vec3 c) {
    c = clamp(c, 0.0, 1.0);
    vec3 curve = 1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055;
    return mix(curve, c * 12.92, lessThanEqual(c, vec3(0.0031308)));
}
