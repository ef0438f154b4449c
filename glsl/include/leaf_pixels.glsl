// Pixels of leaves, counted as they are drawn: for fragments that nothing rejects any more.
#extension GL_EXT_buffer_reference_uvec2 : require

layout(buffer_reference, scalar, buffer_reference_align = 4) buffer LeafPixels { uint at[]; };

void count_pixel(uint leaf) {
    atomicAdd(LeafPixels(frame.leaf_pixels).at[leaf], 1u);
}
