// Pixels of drawn triangles, counted as they are drawn: for fragments that nothing rejects any more.
#extension GL_EXT_buffer_reference_uvec2 : require

layout(buffer_reference, scalar, buffer_reference_align = 4) buffer DrawnPixels { uint at[]; };

void count_pixel(uint drawn) {
    atomicAdd(DrawnPixels(frame.drawn_pixels).at[drawn], 1u);
}
