// The scene and the light as shaders read them: by device address, or as texels of a word each.
//
// A rasteriser on the CPU loads by address a pixel at a time, and gathers texels of all pixels at once (docs/lavapipe.md).
#extension GL_EXT_samplerless_texture_functions : require

layout(constant_id = 0) const bool TEXEL_BUFFERS = false; // src/pass/texel_buffers.rs

layout(set = 0, binding = 7) uniform utextureBuffer position_words;
layout(set = 0, binding = 8) uniform utextureBuffer triangle_words;
layout(set = 0, binding = 9) uniform utextureBuffer visibility_triangle_words;
layout(set = 0, binding = 10) uniform utextureBuffer material_words;
layout(set = 0, binding = 11) uniform utextureBuffer texture_words;
layout(set = 0, binding = 12) uniform utextureBuffer texel_words;
layout(set = 0, binding = 13) uniform utextureBuffer slot_words;
layout(set = 0, binding = 14) uniform utextureBuffer drawn_triangle_words;
layout(set = 0, binding = 15) uniform utextureBuffer drawn_list_words;

// Words of each struct (src/pass/shared.rs).
const uint TRIANGLE_WORDS = 10u;
const uint VISIBILITY_TRIANGLE_WORDS = 4u;
const uint MATERIAL_WORDS = 12u;
const uint TEXTURE_WORDS = 8u + MAX_LEVELS;
const uint SLOT_WORDS = 10u;
const uint DRAWN_TRIANGLE_WORDS = 5u;

#define WORD(buffer, index) texelFetch(buffer, int(index)).x
#define WORDS2(buffer, index) uvec2(WORD(buffer, index), WORD(buffer, index + 1u))
#define WORDS3(buffer, index) uvec3(WORDS2(buffer, index), WORD(buffer, index + 2u))

vec3 position_at(uint vertex) {
    if (TEXEL_BUFFERS) {
        return uintBitsToFloat(WORDS3(position_words, 3u * vertex));
    }
    return frame.positions.at[vertex];
}

uvec3 triangle_corners(uint triangle) {
    if (TEXEL_BUFFERS) {
        return WORDS3(triangle_words, TRIANGLE_WORDS * triangle);
    }
    return frame.triangles.at[triangle].corners;
}

uint triangle_corner(uint triangle, uint corner) {
    if (TEXEL_BUFFERS) {
        return WORD(triangle_words, TRIANGLE_WORDS * triangle + corner);
    }
    return frame.triangles.at[triangle].corners[corner];
}

uint triangle_material(uint triangle) {
    if (TEXEL_BUFFERS) {
        return WORD(triangle_words, TRIANGLE_WORDS * triangle + 3u);
    }
    return frame.triangles.at[triangle].material;
}

vec2 triangle_uv(uint triangle, uint corner) {
    if (TEXEL_BUFFERS) {
        return uintBitsToFloat(WORDS2(triangle_words, TRIANGLE_WORDS * triangle + 4u + 2u * corner));
    }
    return frame.triangles.at[triangle].uv[corner];
}

uint visibility_triangle_corner(uint index, uint corner) {
    if (TEXEL_BUFFERS) {
        return WORD(visibility_triangle_words, VISIBILITY_TRIANGLE_WORDS * index + corner);
    }
    return frame.visibility_triangles.at[index].corners[corner];
}

uint visibility_triangle_id(uint index) {
    if (TEXEL_BUFFERS) {
        return WORD(visibility_triangle_words, VISIBILITY_TRIANGLE_WORDS * index + 3u);
    }
    return frame.visibility_triangles.at[index].id;
}

Material material_at(uint material) {
    if (TEXEL_BUFFERS) {
        uint first = MATERIAL_WORDS * material;
        Material m;
        m.kd = uintBitsToFloat(WORDS3(material_words, first));
        m.map_kd = WORD(material_words, first + 3u);
        m.ks = uintBitsToFloat(WORDS3(material_words, first + 4u));
        m.map_d = WORD(material_words, first + 7u);
        m.ke = uintBitsToFloat(WORDS3(material_words, first + 8u));
        m.map_ke = WORD(material_words, first + 11u);
        return m;
    }
    return frame.materials.at[material];
}

uint material_map_d(uint material) {
    if (TEXEL_BUFFERS) {
        return WORD(material_words, MATERIAL_WORDS * material + 7u);
    }
    return frame.materials.at[material].map_d;
}

ivec2 texture_extent(uint index) {
    if (TEXEL_BUFFERS) {
        return ivec2(WORDS2(texture_words, TEXTURE_WORDS * index));
    }
    return ivec2(frame.textures.at[index].extent);
}

uint texture_levels(uint index) {
    if (TEXEL_BUFFERS) {
        return WORD(texture_words, TEXTURE_WORDS * index + 2u);
    }
    return frame.textures.at[index].levels;
}

uint texture_flags(uint index) {
    if (TEXEL_BUFFERS) {
        return WORD(texture_words, TEXTURE_WORDS * index + 3u);
    }
    return frame.textures.at[index].flags;
}

vec2 texture_scale(uint index) {
    if (TEXEL_BUFFERS) {
        return uintBitsToFloat(WORDS2(texture_words, TEXTURE_WORDS * index + 4u));
    }
    return frame.textures.at[index].scale;
}

vec2 texture_offset(uint index) {
    if (TEXEL_BUFFERS) {
        return uintBitsToFloat(WORDS2(texture_words, TEXTURE_WORDS * index + 6u));
    }
    return frame.textures.at[index].offset;
}

// Index of a level's first texel.
uint texture_first(uint index, uint level) {
    if (TEXEL_BUFFERS) {
        return WORD(texture_words, TEXTURE_WORDS * index + 8u + level);
    }
    return frame.textures.at[index].first[level];
}

uint texel_bits(uint index) {
    if (TEXEL_BUFFERS) {
        return WORD(texel_words, index);
    }
    return frame.texels.at[index];
}

uint drawn_id_at(uint place) {
    if (TEXEL_BUFFERS) {
        return WORD(drawn_list_words, place);
    }
    return frame.drawn_list.at[place];
}

uint drawn_triangle_slot(uint drawn_id, uint corner) {
    if (TEXEL_BUFFERS) {
        return WORD(drawn_triangle_words, DRAWN_TRIANGLE_WORDS * drawn_id + corner);
    }
    return frame.drawn_triangles.at[drawn_id].slots[corner];
}

uint drawn_triangle_face(uint drawn_id) {
    if (TEXEL_BUFFERS) {
        return WORD(drawn_triangle_words, DRAWN_TRIANGLE_WORDS * drawn_id + 3u);
    }
    return frame.drawn_triangles.at[drawn_id].face;
}

uint drawn_triangle_flat_slot(uint drawn_id) {
    if (TEXEL_BUFFERS) {
        return WORD(drawn_triangle_words, DRAWN_TRIANGLE_WORDS * drawn_id + 4u);
    }
    return frame.drawn_triangles.at[drawn_id].flat_slot;
}

vec3 slot_position(uint slot) {
    if (TEXEL_BUFFERS) {
        return uintBitsToFloat(WORDS3(slot_words, SLOT_WORDS * slot));
    }
    return frame.slots.at[slot].position;
}

float slot_weight(uint slot) {
    if (TEXEL_BUFFERS) {
        return uintBitsToFloat(WORD(slot_words, SLOT_WORDS * slot + 3u));
    }
    return frame.slots.at[slot].weight;
}

vec3 slot_diffuse(uint slot) {
    if (TEXEL_BUFFERS) {
        return uintBitsToFloat(WORDS3(slot_words, SLOT_WORDS * slot + 4u));
    }
    return frame.slots.at[slot].diffuse;
}

vec3 slot_specular(uint slot) {
    if (TEXEL_BUFFERS) {
        return uintBitsToFloat(WORDS3(slot_words, SLOT_WORDS * slot + 7u));
    }
    return frame.slots.at[slot].specular;
}
