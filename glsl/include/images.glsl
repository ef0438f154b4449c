// The images of a frame, read at the pixel itself: face id + 1 (0: nothing), and k_d, k_s, L_e, D and S
// (docs/method/what-a-pixel-shows.md).
#extension GL_EXT_samplerless_texture_functions : require

layout(set = 0, binding = 1) uniform utexture2D ids;
layout(set = 0, binding = 2) uniform texture2D image_kd;
layout(set = 0, binding = 3) uniform texture2D image_ks;
layout(set = 0, binding = 4) uniform texture2D image_emission;
layout(set = 0, binding = 5) uniform texture2D image_diffuse;
layout(set = 0, binding = 6) uniform texture2D image_specular;
