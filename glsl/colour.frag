#version 460
// Colour: k_d, k_s and L_e of the face that each pixel shows, textures filtered over the pixel's footprint on the
// face's plane.
#extension GL_GOOGLE_include_directive : require
#include "frame.glsl"
#include "images.glsl"
#include "texture.glsl"
#include "barycentrics.glsl"
#include "half.glsl"

layout(location = 0) out vec4 out_kd; // a: coverage
layout(location = 1) out vec4 out_ks;
layout(location = 2) out vec4 out_emission;

// A filtered look-up times a colour; the colour alone without texture.
vec3 textured(vec3 colour, uint map, vec2 uv[3]) {
    return map == NONE ? colour : colour * texture_filtered(map, uv[0], uv[1] - uv[0], uv[2] - uv[0]);
}

vec4 stored(vec3 colour) {
    return vec4(nearest_half(min(colour, HALF_MAX)), 1.0);
}

void main() {
    uint id = texelFetch(ids, ivec2(gl_FragCoord.xy), 0).x;
    out_kd = out_ks = out_emission = vec4(0.0);
    if (id == 0u) {
        return;
    }
    uint triangle = (id - 1u) >> 1;
    bool back = ((id - 1u) & 1u) == 1u;
    Material m = frame.materials.at[frame.triangles.at[triangle].material];
    bool emits = m.ke != vec3(0.0) && (!back || frame.emits_back != 0u);
    vec2 uv[3] = vec2[3](vec2(0.0), vec2(0.0), vec2(0.0)); // at the pixel, its right and its lower neighbour
    if (m.map_kd != NONE || (emits && m.map_ke != NONE)) {
        Triangle t = frame.triangles.at[triangle];
        vec3 a = frame.positions.at[t.corners.x];
        vec3 edge1 = frame.positions.at[t.corners.y] - a;
        vec3 edge2 = frame.positions.at[t.corners.z] - a;
        vec2 centre = gl_FragCoord.xy + frame.jitter;
        vec2 steps[3] = vec2[3](vec2(0.0), vec2(frame.filter_width, 0.0), vec2(0.0, frame.filter_width));
        for (int i = 0; i < 3; ++i) {
            vec2 b = barycentrics(a, edge1, edge2, centre + steps[i]);
            uv[i] = t.uv[0] * (1.0 - b.x - b.y) + t.uv[1] * b.x + t.uv[2] * b.y;
        }
    }
    out_kd = stored(textured(m.kd, m.map_kd, uv));
    out_ks = stored(m.ks);
    if (emits) {
        out_emission = stored(textured(m.ke, m.map_ke, uv) * frame.emission_scale);
    }
}
