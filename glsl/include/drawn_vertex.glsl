#extension GL_EXT_buffer_reference_uvec2 : require
// A vertex of a drawn triangle from the list of this draw.
// What goes to the fragment fills few vectors: a software rasteriser sets each of them up for every triangle.
layout(location = 0) out vec4 weighted_diffuse; // a: the weight
layout(location = 1) flat out uvec2 drawn; // face, id
#ifndef MATTE // where nothing has highlights
layout(location = 2) out vec3 weighted_specular;
#endif

#ifdef TURNED // by normal maps
layout(location = 3) out vec4 weighted_light; // a: how wide it is

layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer LightVectors { vec4 at[]; };
#endif

void set_drawn_vertex() {
    uint drawn_id = drawn_id_at(uint(gl_VertexIndex) / 3u);
    uint slot = drawn_triangle_slot(drawn_id, uint(gl_VertexIndex) % 3u);
    drawn = uvec2(drawn_triangle_face(drawn_id), drawn_id);
    uint flat_slot = drawn_triangle_flat_slot(drawn_id);
    uint shown = flat_slot == NONE ? slot : flat_slot;
    float weight = slot_weight(shown);
    weighted_diffuse = vec4(weight * slot_diffuse(shown), weight);
#ifndef MATTE
    weighted_specular = weight * slot_specular(shown);
#endif
#ifdef TURNED
    weighted_light = weight * LightVectors(frame.light_vectors).at[shown];
#endif
    set_position(slot_position(slot));
}
