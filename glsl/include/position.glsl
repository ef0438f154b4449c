// The one transform of all passes: `precise`, so that the same vertex gets the same depth in each of them and the
// luminance pass can test for EQUAL. (`invariant` would make Mesa warn, docs/lavapipe.md.)
out gl_PerVertex {
    precise vec4 gl_Position;
};

void set_position(vec3 position) {
    gl_Position = frame.clip_from_world * vec4(position, 1.0);
}
