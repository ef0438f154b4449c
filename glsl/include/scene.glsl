// The scene and the light as shaders read them: by device address, or as texels of one or four words.
//
// A rasteriser on the CPU loads by address word by word and pixel by pixel, and texels whole and of eight pixels at once (docs/lavapipe.md).
#extension GL_EXT_samplerless_texture_functions : require

layout(constant_id = 0) const bool TEXEL_BUFFERS = false; // src/pass/texel_buffers.rs
// What some of the scene needs (src/pass/needs.rs).
layout(constant_id = 9) const bool METALLIC_ROUGHNESS = true;
layout(constant_id = 10) const bool NORMAL_MAPS = true;

layout(set = 0, binding = 7) uniform utextureBuffer position_quads;
layout(set = 0, binding = 8) uniform utextureBuffer triangle_quads;
layout(set = 0, binding = 9) uniform utextureBuffer visibility_triangle_quads;
layout(set = 0, binding = 10) uniform utextureBuffer material_quads;
layout(set = 0, binding = 11) uniform utextureBuffer texture_quads;
layout(set = 0, binding = 12) uniform utextureBuffer texel_words;
layout(set = 0, binding = 13) uniform utextureBuffer slot_words;
layout(set = 0, binding = 14) uniform utextureBuffer drawn_triangle_words;
layout(set = 0, binding = 15) uniform utextureBuffer drawn_list_words;

const float LEAST_ROUGHNESS = 0.03; // bsdf::LEAST_ROUGHNESS

// Quads or words of each struct (src/pass/shared.rs).
const uint TRIANGLE_QUADS = 3u;
const uint MATERIAL_QUADS = 6u;
const uint TEXTURE_QUADS = 7u;
const uint SLOT_WORDS = 10u;
const uint DRAWN_TRIANGLE_WORDS = 5u;

#define QUAD(buffer, index) texelFetch(buffer, int(index))
#define WORD(buffer, index) texelFetch(buffer, int(index)).x
#define WORDS3(buffer, index) uvec3(WORD(buffer, index), WORD(buffer, index + 1u), WORD(buffer, index + 2u))

vec3 position_at(uint vertex) {
    if (TEXEL_BUFFERS) {
        return uintBitsToFloat(QUAD(position_quads, vertex).xyz);
    }
    return frame.positions.at[vertex].xyz;
}

uvec3 triangle_corners(uint triangle) {
    if (TEXEL_BUFFERS) {
        return QUAD(triangle_quads, TRIANGLE_QUADS * triangle).xyz;
    }
    return frame.triangles.at[triangle].corners;
}

uint triangle_corner(uint triangle, uint corner) {
    if (TEXEL_BUFFERS) {
        return QUAD(triangle_quads, TRIANGLE_QUADS * triangle)[corner];
    }
    return frame.triangles.at[triangle].corners[corner];
}

uint triangle_material(uint triangle) {
    if (TEXEL_BUFFERS) {
        return QUAD(triangle_quads, TRIANGLE_QUADS * triangle).w;
    }
    return frame.triangles.at[triangle].material;
}

vec2 triangle_uv(uint triangle, uint corner) {
    if (TEXEL_BUFFERS) {
        uvec4 quad = QUAD(triangle_quads, TRIANGLE_QUADS * triangle + 1u + corner / 2u);
        return uintBitsToFloat(corner == 1u ? quad.zw : quad.xy);
    }
    return frame.triangles.at[triangle].uv[corner];
}

uint visibility_triangle_corner(uint index, uint corner) {
    if (TEXEL_BUFFERS) {
        return QUAD(visibility_triangle_quads, index)[corner];
    }
    return frame.visibility_triangles.at[index].corners[corner];
}

uint visibility_triangle_id(uint index) {
    if (TEXEL_BUFFERS) {
        return QUAD(visibility_triangle_quads, index).w;
    }
    return frame.visibility_triangles.at[index].id;
}

Material material_at(uint material) {
    if (TEXEL_BUFFERS) {
        uint first = MATERIAL_QUADS * material;
        uvec4 diffuse = QUAD(material_quads, first);
        uvec4 specular = QUAD(material_quads, first + 1u);
        uvec4 emitted = QUAD(material_quads, first + 2u);
        Material m;
        m.kd = uintBitsToFloat(diffuse.xyz);
        m.map_kd = diffuse.w;
        m.ks = uintBitsToFloat(specular.xyz);
        m.map_d = specular.w;
        m.ke = uintBitsToFloat(emitted.xyz);
        m.map_ke = emitted.w;
        if (METALLIC_ROUGHNESS || NORMAL_MAPS) {
            uvec4 reflected = QUAD(material_quads, first + 3u);
            uvec4 rough = QUAD(material_quads, first + 4u);
            m.f0 = uintBitsToFloat(reflected.xyz);
            m.map_metallic = reflected.w;
            m.metallic = uintBitsToFloat(rough.x);
            m.roughness = uintBitsToFloat(rough.y);
            m.map_roughness = rough.z;
            m.map_normal = rough.w;
            m.normal_scale = uintBitsToFloat(QUAD(material_quads, first + 5u).x);
        }
        return m;
    }
    return frame.materials.at[material];
}

uint material_map_d(uint material) {
    if (TEXEL_BUFFERS) {
        return QUAD(material_quads, MATERIAL_QUADS * material + 1u).w;
    }
    return frame.materials.at[material].map_d;
}

ivec2 texture_extent(uint index) {
    if (TEXEL_BUFFERS) {
        return ivec2(QUAD(texture_quads, TEXTURE_QUADS * index).xy);
    }
    return ivec2(frame.textures.at[index].extent);
}

uint texture_levels(uint index) {
    if (TEXEL_BUFFERS) {
        return QUAD(texture_quads, TEXTURE_QUADS * index).z;
    }
    return frame.textures.at[index].levels;
}

uint texture_flags(uint index) {
    if (TEXEL_BUFFERS) {
        return QUAD(texture_quads, TEXTURE_QUADS * index).w;
    }
    return frame.textures.at[index].flags;
}

mat2 texture_matrix(uint index) {
    if (TEXEL_BUFFERS) {
        vec4 columns = uintBitsToFloat(QUAD(texture_quads, TEXTURE_QUADS * index + 1u));
        return mat2(columns.xy, columns.zw);
    }
    return frame.textures.at[index].matrix;
}

vec2 texture_offset(uint index) {
    if (TEXEL_BUFFERS) {
        return uintBitsToFloat(QUAD(texture_quads, TEXTURE_QUADS * index + 2u).xy);
    }
    return frame.textures.at[index].offset;
}

// Index of a level's first texel.
uint texture_first(uint index, uint level) {
    if (TEXEL_BUFFERS) {
        uint word = 2u + level; // after the offset
        return QUAD(texture_quads, TEXTURE_QUADS * index + 2u + word / 4u)[word % 4u];
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
