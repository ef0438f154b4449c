// Texture filtering by hand: texels lie in one buffer, since descriptor indexing is not everywhere.
// Level 0 follows scene::texture::Texture::sample to the letter.

vec3 linear_from_srgb(vec3 c) {
    vec3 curve = pow((c + 0.055) / 1.055, vec3(2.4));
    return mix(curve, c / 12.92, lessThanEqual(c, vec3(0.04045)));
}

// Linear RGB and A of a texel inside the level.
vec4 texel(uint first, int width, ivec2 p) {
    vec4 c = unpackUnorm4x8(frame.texels.at[first + uint(p.y * width + p.x)]);
    return vec4(linear_from_srgb(c.rgb), c.a);
}

// The four texels around a point of a level, repeating: corners in x..y (columns) and z..w (rows), and the fraction.
ivec4 footprint(ivec2 size, vec2 uv, out vec2 fraction) {
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

// Bilinear look-up at one level of a texture of `extent`; uv in OBJ convention (v up).
vec4 texture_level(uint index, ivec2 extent, uint level, vec2 uv) {
    ivec2 size = max(extent >> int(level), ivec2(1));
    uint first = frame.textures.at[index].first[level];
    vec2 f;
    ivec4 c = footprint(size, uv, f);
    vec4 top = mix(texel(first, size.x, c.xz), texel(first, size.x, c.yz), f.x);
    vec4 bottom = mix(texel(first, size.x, c.xw), texel(first, size.x, c.yw), f.x);
    return mix(top, bottom, f.y);
}

// Trilinear look-up; the gradients are those of uv from one pixel to the next. Magnified: level 0.
vec3 texture_filtered(uint index, vec2 uv, vec2 d_dx, vec2 d_dy) {
    ivec2 extent = ivec2(frame.textures.at[index].extent);
    float texels = max(length(d_dx * vec2(extent)), length(d_dy * vec2(extent)));
    float last = float(frame.textures.at[index].levels - 1u);
    float lod = texels > 1.0 ? min(log2(texels), last) : 0.0; // not a number counts as magnified
    uint level = uint(lod);
    vec3 fine = texture_level(index, extent, level, uv).rgb;
    float share = lod - float(level);
    return share > 0.0 ? mix(fine, texture_level(index, extent, level + 1u, uv).rgb, share) : fine;
}

// The cut-out rule, scene::Scene::is_opaque_at.
bool is_opaque(uint map_d, vec2 uv) {
    vec2 f;
    ivec2 size = ivec2(frame.textures.at[map_d].extent);
    uint first = frame.textures.at[map_d].first[0];
    ivec4 c = footprint(size, uv, f);
    vec4 alpha;
    alpha.x = float(frame.texels.at[first + uint(c.z * size.x + c.x)] >> 24);
    alpha.y = float(frame.texels.at[first + uint(c.z * size.x + c.y)] >> 24);
    alpha.z = float(frame.texels.at[first + uint(c.w * size.x + c.x)] >> 24);
    alpha.w = float(frame.texels.at[first + uint(c.w * size.x + c.y)] >> 24);
    return mix(mix(alpha.x, alpha.y, f.x), mix(alpha.z, alpha.w, f.x), f.y) >= 127.5;
}
