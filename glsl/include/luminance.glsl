// Luminance of a leaf: (w D, w S, w) interpolated, then divided, so that invalid vertices (w = 0) take no part.
layout(location = 0) in vec3 weighted_diffuse;
layout(location = 1) in vec3 weighted_specular;
layout(location = 2) in float weight;
layout(location = 3) flat in uint face;
layout(location = 4) flat in uint leaf;
layout(location = 0) out vec4 out_diffuse; // a: 1, "drawn"
layout(location = 1) out vec4 out_specular;
layout(location = 2) out uint out_leaf;

const float HALF_MAX = 65504.0;

void write_luminance() {
    float factor = weight > 1e-6 ? frame.luminance_scale / weight : 0.0;
    out_diffuse = vec4(min(weighted_diffuse * factor, HALF_MAX), 1.0);
    out_specular = vec4(min(weighted_specular * factor, HALF_MAX), 1.0);
    out_leaf = leaf + 1u;
}
