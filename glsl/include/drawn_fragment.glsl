// What luminance.vert sends of a drawn triangle.
layout(location = 0) in vec4 weighted_diffuse; // a: the weight
layout(location = 1) flat in uvec2 drawn; // face, id
#ifdef MATTE
const vec3 weighted_specular = vec3(0.0);
#else
layout(location = 2) in vec3 weighted_specular;
#endif

void write_drawn() {
    write_luminance(weighted_diffuse.rgb, weighted_specular, weighted_diffuse.a, drawn.y);
}
