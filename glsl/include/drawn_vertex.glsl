// A vertex of a drawn triangle from the list of this draw.
layout(location = 0) out vec3 weighted_diffuse;
layout(location = 1) out vec3 weighted_specular;
layout(location = 2) out float weight;
layout(location = 3) flat out uint face;
layout(location = 4) flat out uint drawn;

void set_drawn_vertex() {
    drawn = frame.drawn_list.at[uint(gl_VertexIndex) / 3u];
    uint slot = frame.drawn_triangles.at[drawn].slots[uint(gl_VertexIndex) % 3u];
    face = frame.drawn_triangles.at[drawn].face;
    uint flat_slot = frame.drawn_triangles.at[drawn].flat_slot;
    uint shown = flat_slot == NONE ? slot : flat_slot;
    weight = frame.slots.at[shown].weight;
    weighted_diffuse = weight * frame.slots.at[shown].diffuse;
    weighted_specular = weight * frame.slots.at[shown].specular;
    set_position(frame.slots.at[slot].position);
}
