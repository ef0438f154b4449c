#version 460
// Colour: k_d, k_s and L_e of the face that each pixel shows, textures filtered over the pixel's footprint on the
// face's plane.
#extension GL_GOOGLE_include_directive : require
#include "frame.glsl"
#include "scene.glsl"
#include "images.glsl"
#include "texture.glsl"
#include "barycentrics.glsl"
#include "half.glsl"
#include "normals.glsl"
#include "metallic_roughness.glsl"
#include "sky.glsl"
#extension GL_EXT_buffer_reference_uvec2 : require

// What some of the scene needs (src/pass/needs.rs).
layout(constant_id = 4) const bool VERTEX_COLOURS = true;
layout(constant_id = 5) const bool TEXTURES = true;
layout(constant_id = 6) const bool EMISSION_TEXTURES = true;
layout(constant_id = 12) const bool SKY = true;

layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Colours { vec3 at[]; };

layout(location = 0) out vec4 out_kd; // a: coverage
layout(location = 1) out vec4 out_ks;
layout(location = 2) out vec4 out_emission;

// Colour of the vertices at barycentric weights of corners 1 and 2, scene::Scene::colour_at.
vec3 vertex_colour(uint triangle, vec2 b) {
    Colours of = Colours(frame.colours);
    uint first = 3u * triangle;
    vec3 colour = of.at[first] * (1.0 - b.x - b.y) + of.at[first + 1u] * b.x + of.at[first + 2u] * b.y;
    return clamp(colour, 0.0, 1.0); // the pixel's centre may lie a little outside
}

vec4 stored(vec3 colour) {
    return vec4(nearest_half(min(colour, HALF_MAX)), 1.0);
}

void main() {
    uint id = texelFetch(ids, ivec2(gl_FragCoord.xy), 0).x;
    out_kd = out_ks = out_emission = vec4(0.0);
    if (id == 0u) {
        if (SKY) {
            out_emission = stored(sky_at(gl_FragCoord.xy + frame.jitter, frame.filter_width));
        }
        return;
    }
    uint triangle = (id - 1u) >> 1;
    bool back = ((id - 1u) & 1u) == 1u;
    Material m = material_at(triangle_material(triangle));
    bool emits = m.ke != vec3(0.0) && (!back || frame.emits_back != 0u);
    vec2 uv[3] = vec2[3](vec2(0.0), vec2(0.0), vec2(0.0)); // at the pixel, its right and its lower neighbour
    bool painted = VERTEX_COLOURS && frame.colours != uvec2(0u);
    bool rough = METALLIC_ROUGHNESS && m.metallic >= 0.0;
    bool turned = NORMAL_MAPS && m.map_normal != NONE;
    vec3 normal = vec3(0.0); // of the side that shows
    if ((VERTEX_COLOURS || TEXTURES || METALLIC_ROUGHNESS || NORMAL_MAPS) &&
        (painted || rough || turned || m.map_kd != NONE || (emits && m.map_ke != NONE))) {
        uvec3 corners = triangle_corners(triangle);
        vec3 a = position_at(corners.x);
        vec3 edge1 = position_at(corners.y) - a;
        vec3 edge2 = position_at(corners.z) - a;
        vec2 uv_a = triangle_uv(triangle, 0u);
        vec2 uv_b = triangle_uv(triangle, 1u);
        vec2 uv_c = triangle_uv(triangle, 2u);
        vec2 centre = gl_FragCoord.xy + frame.jitter;
        vec2 steps[3] = vec2[3](vec2(0.0), vec2(frame.filter_width, 0.0), vec2(0.0, frame.filter_width));
        for (int i = 0; i < 3; ++i) {
            vec2 b = barycentrics(a, edge1, edge2, centre + steps[i]);
            uv[i] = uv_a * (1.0 - b.x - b.y) + uv_b * b.x + uv_c * b.y;
            if (painted && i == 0) {
                m.kd *= vertex_colour(triangle, b);
            }
            if ((rough || turned) && i == 0) {
                normal = shading_normal(triangle, b);
            }
        }
        if (turned) {
            vec3 texel = texture_filtered(m.map_normal, uv[0], uv[1] - uv[0], uv[2] - uv[0]);
            normal = mapped_normal(normal, edge1, edge2, uv_b - uv_a, uv_c - uv_a, texel, m.normal_scale);
        }
        normal = back ? -normal : normal;
    }
    m.ke = emits ? m.ke * frame.emission_scale : vec3(0.0);
    // One look-up's code in a loop, for k_d, then for L_e: a second turn only where a pixel needs it (see texture_filtered).
    uint next = EMISSION_TEXTURES && emits ? m.map_ke : NONE;
    uint map = TEXTURES ? m.map_kd : NONE;
    bool of_kd = map != NONE;
    if (!of_kd) {
        map = next;
        next = NONE;
    }
    if (TEXTURES) {
        bool again = map != NONE;
        do {
            vec3 factor = again ? texture_filtered(map, uv[0], uv[1] - uv[0], uv[2] - uv[0]) : vec3(1.0);
            m.kd *= of_kd ? factor : vec3(1.0);
            m.ke *= of_kd ? vec3(1.0) : factor;
            of_kd = false;
            map = next;
            next = NONE;
            again = map != NONE;
        } while (again);
    }
    if (rough) {
        if (m.map_metallic != NONE) {
            m.metallic *= texture_filtered(m.map_metallic, uv[0], uv[1] - uv[0], uv[2] - uv[0]).b;
        }
        if (m.map_roughness != NONE) {
            m.roughness *= texture_filtered(m.map_roughness, uv[0], uv[1] - uv[0], uv[2] - uv[0]).g;
        }
        vec2 ndc = (gl_FragCoord.xy + frame.jitter) * frame.pixel - 1.0;
        vec3 to_eye = -normalize(frame.forward + frame.right * ndc.x + frame.down * ndc.y);
        metallic_roughness(m.kd, m.metallic, m.roughness, m.f0, dot(normal, to_eye), m.kd, m.ks);
    }
    out_kd = stored(m.kd);
    out_ks = stored(m.ks);
    out_emission = emits ? stored(m.ke) : vec4(0.0);
}
