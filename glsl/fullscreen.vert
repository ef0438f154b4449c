#version 460
// One triangle that covers the image, farther than any leaf but nearer than nothing (depth 0); no less than a step of 16-bit
// depth.
#extension GL_GOOGLE_include_directive : require
void main() {
    gl_Position = vec4(gl_VertexIndex == 1 ? 3.0 : -1.0, gl_VertexIndex == 2 ? 3.0 : -1.0, 2e-5, 1.0);
}
