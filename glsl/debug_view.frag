#version 460
// A debug view in place of the picture: one of the images, or what is known of drawn triangles, by a number each.
#extension GL_GOOGLE_include_directive : require
#include "frame.glsl"
#include "images.glsl"
#include "radiance.glsl"
#include "uncovered.glsl"
#include "tone_mapping.glsl"
#include "display.glsl"
#include "false_colour.glsl"

layout(set = 0, binding = 7) uniform utexture2D drawn_ids;    // drawn triangle + 1 (0: none)
layout(set = 0, binding = 8) uniform utextureBuffer values;   // by drawn triangle
layout(set = 0, binding = 9) uniform utextureBuffer reference; // by pixel, row by row: bits of radiance and coverage
layout(constant_id = 2) const uint VIEW = 0u; // src/pass/debug_view.rs

const uint KD = 0u;
const uint KS = 1u;
const uint EMISSION = 2u;
const uint DIFFUSE = 3u;
const uint SPECULAR = 4u;
const uint FACES = 5u;
const uint LEVEL = 6u;
const uint ERROR = 7u;
const uint KNOWLEDGE = 8u;
const uint MESH = 9u;
const uint LIGHT_MESH = 10u;
const uint REFERENCE = 11u;
const uint BESIDE = 12u;

layout(location = 0) out vec4 display;

ivec2 inside(ivec2 p) {
    return min(p, textureSize(ids, 0) - 1);
}

// The number of a pixel's drawn triangle.
uint value_at(ivec2 p) {
    uint drawn = texelFetch(drawn_ids, p, 0).x;
    return drawn == 0u || int(drawn) > textureSize(values) ? 0u : texelFetch(values, int(drawn) - 1).x;
}

// What a mesh's lines run between: the drawn triangle, or what its number says.
uint part_at(ivec2 p) {
    return VIEW == MESH ? texelFetch(drawn_ids, p, 0).x : value_at(p);
}

// The picture at half its brightness, with a line where a triangle ends.
vec3 with_lines(ivec2 p, vec3 picture) {
    uvec2 here = uvec2(part_at(p), texelFetch(ids, p, 0).x);
    bool line = false;
    for (int i = 0; i < 2; ++i) {
        ivec2 next = inside(p + ivec2(1 - i, i));
        line = line || part_at(next) != here.x || texelFetch(ids, next, 0).x != here.y;
    }
    return line ? LINE : 0.5 * picture;
}

vec3 coloured(ivec2 p) {
    uint face = texelFetch(ids, p, 0).x;
    Luminance light = luminance_around(p);
    switch (VIEW) {
        case KD: return srgb_from_linear(texelFetch(image_kd, p, 0).rgb);
        case KS: return srgb_from_linear(texelFetch(image_ks, p, 0).rgb);
        case EMISSION: return displayed(vec4(texelFetch(image_emission, p, 0).rgb / frame.emission_scale, 1.0)).rgb;
        case DIFFUSE: return displayed(vec4(light.diffuse / frame.luminance_scale, 1.0)).rgb;
        case SPECULAR: return displayed(vec4(light.specular / frame.luminance_scale, 1.0)).rgb;
        case FACES: return colour_of_number(face);
        case LEVEL: return colour_of_level(value_at(p));
        case ERROR: return colour_of_error(uintBitsToFloat(value_at(p)));
        case KNOWLEDGE: return colour_of_knowledge(light.diffuse / frame.luminance_scale);
        case BESIDE: return displayed(radiance(p, light)).rgb;
        default: return with_lines(p, displayed(radiance(p, light)).rgb);
    }
}

vec4 reference_at(ivec2 p) {
    int pixel = p.y * textureSize(ids, 0).x + p.x;
    return pixel < textureSize(reference) ? uintBitsToFloat(texelFetch(reference, pixel)) : vec4(0.0);
}

void main() {
    ivec2 p = ivec2(gl_FragCoord.xy);
    int middle = textureSize(ids, 0).x / 2;
    if (VIEW == BESIDE && p.x == middle) {
        display = vec4(LINE, 1.0);
        return;
    }
    if (VIEW == REFERENCE || VIEW == BESIDE && p.x > middle) {
        display = displayed(reference_at(p));
        return;
    }
    float coverage = texelFetch(image_kd, p, 0).a;
    // Where no geometry is there is nothing but what is emitted from beyond.
    bool shows = coverage > 0.0 || VIEW == BESIDE || VIEW == EMISSION;
    display = vec4(shows ? coloured(p) : vec3(0.0), coverage);
}
