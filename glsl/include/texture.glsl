// Texture filtering by hand: texels lie in one buffer, since descriptor indexing is not everywhere.
// Level 0 follows scene::texture::Texture to the letter.

// What some texture of the scene needs (src/pass/needs.rs).
layout(constant_id = 7) const bool BRIGHT_TEXTURES = true;
layout(constant_id = 8) const bool CLAMPED_TEXTURES = true;
layout(constant_id = 11) const bool LINEAR_TEXTURES = true;

vec3 linear_from_srgb(vec3 c) {
    vec3 curve = pow((c + 0.055) / 1.055, vec3(2.4));
    return mix(curve, c / 12.92, lessThanEqual(c, vec3(0.04045)));
}

// Linear RGB of three sRGB codes, a byte each: by the curve, or by the table before the texels, which is less to compute than three powers.
vec3 linear_from_codes(uint bits) {
    if (TEXEL_BUFFERS) {
        uvec3 codes = uvec3(bits, bits >> 8, bits >> 16) & 255u;
        return uintBitsToFloat(uvec3(texel_bits(codes.x), texel_bits(codes.y), texel_bits(codes.z)));
    }
    return linear_from_srgb(unpackUnorm4x8(bits).rgb);
}

// Linear RGB of a texel inside the level.
vec3 texel(uint first, int width, ivec2 p, uint flags) {
    uint bits = texel_bits(first + uint(p.y * width + p.x));
    if (BRIGHT_TEXTURES && (flags & SHARED_EXPONENT) != 0u) {
        uvec3 mantissas = uvec3(bits, bits >> 8, bits >> 16) & 255u;
        return vec3(mantissas) * uintBitsToFloat((max(bits >> 24, 9u) - 9u) << 23);
    }
    if (LINEAR_TEXTURES && (flags & LINEAR) != 0u) {
        return unpackUnorm4x8(bits).rgb;
    }
    return linear_from_codes(bits);
}

// The four texels around a point of a level: corners in x..y (columns) and z..w (rows), and the fraction.
ivec4 footprint(ivec2 size, vec2 uv, uint flags, out vec2 fraction) {
    if (CLAMPED_TEXTURES && (flags & (HELD_U | HELD_V)) != 0u) {
        bvec2 mirrored = notEqual(uvec2(flags) & uvec2(MIRRORED_U, MIRRORED_V), uvec2(0u));
        vec2 inside = mix(uv, 1.0 - abs(2.0 * fract(uv * 0.5) - 1.0), mirrored);
        // Between the middles of the outer texels nothing repeats.
        inside = clamp(inside, 0.5 / vec2(size), 1.0 - 0.5 / vec2(size));
        uv = mix(uv, inside, notEqual(uvec2(flags) & uvec2(HELD_U, HELD_V), uvec2(0u)));
    }
    vec2 wrapped = vec2(uv.x - floor(uv.x), (1.0 - uv.y) - floor(1.0 - uv.y));
    vec2 p = wrapped * vec2(size) - 0.5;
    fraction = p - floor(p);
    ivec2 low = ivec2(floor(p));
    ivec2 high = low + 1;
    low = mix(low, low + size, lessThan(low, ivec2(0)));
    low = mix(low, low - size, greaterThanEqual(low, size));
    high = mix(high, high - size, greaterThanEqual(high, size));
    return ivec4(low.x, high.x, low.y, high.y);
}

// Bilinear look-up at one level of a texture of `extent`; uv in OBJ convention (v up), placed.
vec3 texture_level(uint index, ivec2 extent, uint flags, uint level, vec2 uv) {
    ivec2 size = max(extent >> int(level), ivec2(1));
    uint first = texture_first(index, level);
    vec2 f;
    ivec4 c = footprint(size, uv, flags, f);
    vec3 top = mix(texel(first, size.x, c.xz, flags), texel(first, size.x, c.yz, flags), f.x);
    vec3 bottom = mix(texel(first, size.x, c.xw, flags), texel(first, size.x, c.yw, flags), f.x);
    return mix(top, bottom, f.y);
}

// Where a texture is looked up.
vec2 placed(uint index, vec2 uv) {
    return texture_matrix(index) * uv + texture_offset(index);
}

// Trilinear look-up; the gradients are those of uv from one pixel to the next. Magnified: level 0.
vec3 texture_filtered(uint index, vec2 uv, vec2 d_dx, vec2 d_dy) {
    ivec2 extent = texture_extent(index);
    uint flags = texture_flags(index);
    mat2 matrix = texture_matrix(index);
    vec2 size = vec2(extent);
    float texels = max(length(matrix * d_dx * size), length(matrix * d_dy * size));
    float last = float(texture_levels(index) - 1u);
    float lod = texels > 1.0 ? min(log2(texels), last) : 0.0; // not a number counts as magnified
    uint level = uint(lod);
    vec2 place = placed(index, uv);
    float share = lod - float(level);
    // The coarser level in a loop's second turn, not under a condition: a rasteriser that runs pixels in step on the CPU goes through what is
    // under a condition even if it holds nowhere, but leaves a loop that no pixel is in any more.
    vec3 colour = vec3(0.0);
    float weight = 1.0;
    bool more = share > 0.0;
    bool again;
    do {
        colour = mix(colour, texture_level(index, extent, flags, level, place), weight);
        again = more;
        more = false;
        weight = share;
        ++level;
    } while (again);
    return colour;
}

// The cut-out rule, scene::Scene::is_opaque_at; `place` is where the mask is looked up.
bool is_opaque(uint map_d, vec2 place) {
    vec2 f;
    ivec2 size = texture_extent(map_d);
    uint first = texture_first(map_d, 0u);
    ivec4 c = footprint(size, place, texture_flags(map_d), f);
    vec4 alpha;
    alpha.x = float(texel_bits(first + uint(c.z * size.x + c.x)) >> 24);
    alpha.y = float(texel_bits(first + uint(c.z * size.x + c.y)) >> 24);
    alpha.z = float(texel_bits(first + uint(c.w * size.x + c.x)) >> 24);
    alpha.w = float(texel_bits(first + uint(c.w * size.x + c.y)) >> 24);
    return mix(mix(alpha.x, alpha.y, f.x), mix(alpha.z, alpha.w, f.x), f.y) >= 127.5;
}
