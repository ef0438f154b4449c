// A vertex of a leaf from the list of this draw.
layout(location = 0) out vec3 weighted_diffuse;
layout(location = 1) out vec3 weighted_specular;
layout(location = 2) out float weight;
layout(location = 3) flat out uint face;
layout(location = 4) flat out uint leaf;

void set_leaf_vertex() {
    leaf = frame.leaf_list.at[uint(gl_VertexIndex) / 3u];
    uint slot = frame.leaves.at[leaf].slots[uint(gl_VertexIndex) % 3u];
    face = frame.leaves.at[leaf].face;
    uint flat_slot = frame.leaves.at[leaf].flat_slot;
    uint shown = flat_slot == NONE ? slot : flat_slot;
    weight = frame.slots.at[shown].weight;
    weighted_diffuse = weight * frame.slots.at[shown].diffuse;
    weighted_specular = weight * frame.slots.at[shown].specular;
    set_position(frame.slots.at[slot].position);
}
