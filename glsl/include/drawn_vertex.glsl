// A vertex of a drawn triangle from the list of this draw.
// What goes to the fragment fills few vectors: a software rasteriser sets each of them up for every triangle.
layout(location = 0) out vec4 weighted_diffuse; // a: the weight
layout(location = 1) out vec3 weighted_specular;
layout(location = 2) flat out uvec2 drawn; // face, id

void set_drawn_vertex() {
    uint drawn_id = frame.drawn_list.at[uint(gl_VertexIndex) / 3u];
    uint slot = frame.drawn_triangles.at[drawn_id].slots[uint(gl_VertexIndex) % 3u];
    drawn = uvec2(frame.drawn_triangles.at[drawn_id].face, drawn_id);
    uint flat_slot = frame.drawn_triangles.at[drawn_id].flat_slot;
    uint shown = flat_slot == NONE ? slot : flat_slot;
    float weight = frame.slots.at[shown].weight;
    weighted_diffuse = vec4(weight * frame.slots.at[shown].diffuse, weight);
    weighted_specular = weight * frame.slots.at[shown].specular;
    set_position(frame.slots.at[slot].position);
}
