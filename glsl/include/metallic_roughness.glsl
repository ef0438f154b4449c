// k_d and k_s of the metallic-roughness model as D and S count (src/bsdf, docs/method/reflection.md).

const float DIELECTRIC = 0.04;
// bsdf::diffuse_out_table stands behind the sRGB codes, before the texels.
const uint DIFFUSE_TABLE = 256u;
const uint TABLE_SIZE = 32u;

float table_entry(uint row, uint column) {
    return uintBitsToFloat(texel_bits(DIFFUSE_TABLE + row * TABLE_SIZE + column));
}

// Share of the diffuse part that the highlight leaves to an eye at this cosine.
float diffuse_out(float roughness, float cosine) {
    vec2 at = vec2((roughness - LEAST_ROUGHNESS) / (1.0 - LEAST_ROUGHNESS), sqrt(1.0 - clamp(cosine, 0.0, 1.0)));
    at = clamp(at, 0.0, 1.0) * float(TABLE_SIZE - 1u);
    uvec2 cell = min(uvec2(at), uvec2(TABLE_SIZE - 2u));
    vec2 share = at - vec2(cell);
    vec2 low = vec2(table_entry(cell.x, cell.y), table_entry(cell.x, cell.y + 1u));
    vec2 high = vec2(table_entry(cell.x + 1u, cell.y), table_entry(cell.x + 1u, cell.y + 1u));
    vec2 mean = mix(low, high, share.x);
    return mix(mean.x, mean.y, share.y);
}

// What D and S count times for a base colour; S holds the Fresnel factor of the material's own F0.
void metallic_roughness(vec3 colour, float metallic, float roughness, vec3 own_f0, float cosine, out vec3 kd, out vec3 ks) {
    kd = colour * ((1.0 - metallic) * diffuse_out(clamp(roughness, LEAST_ROUGHNESS, 1.0), cosine));
    vec3 f0 = mix(vec3(DIELECTRIC), colour, metallic);
    ks = mix(vec3(1.0), f0 / max(own_f0, vec3(1e-6)), greaterThan(own_f0, vec3(1e-6)));
}
