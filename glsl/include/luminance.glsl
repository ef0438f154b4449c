// Luminance of a drawn triangle: (w D, w S, w) interpolated, then divided, so that invalid vertices (w = 0) take no part.
#include "half.glsl"

layout(location = 0) out vec4 out_diffuse; // a: 1, "drawn"
layout(location = 1) out uint out_drawn;
#ifndef MATTE // where nothing has highlights
layout(location = 2) out vec4 out_specular;
#endif

// Least weight that a vertex with a value has (refine/publish.rs, COVERED_WEIGHT).
const float LEAST_WEIGHT = 4e-3;

void write_luminance(vec3 weighted_diffuse, vec3 weighted_specular, float weight, uint drawn_id) {
    // A pixel centre may lie a little outside of the triangle (its corners are snapped to the raster), where values are
    // extrapolated: neither the weight below its least value nor a negative luminance is what any vertex says.
    float factor = frame.luminance_scale / max(weight, LEAST_WEIGHT);
    out_diffuse = vec4(nearest_half(clamp(weighted_diffuse * factor, 0.0, HALF_MAX)), 1.0);
#ifndef MATTE
    out_specular = vec4(nearest_half(clamp(weighted_specular * factor, 0.0, HALF_MAX)), 1.0);
#endif
    out_drawn = drawn_id + 1u;
}
