// What luminance.vert sends of a drawn triangle.
layout(location = 0) in vec4 weighted_diffuse; // a: the weight
layout(location = 1) flat in uvec2 drawn; // face, id
#ifdef MATTE
const vec3 weighted_specular = vec3(0.0);
#else
layout(location = 2) in vec3 weighted_specular;
#endif

#ifdef TURNED // by normal maps
layout(location = 3) in vec4 weighted_light; // a: how wide it is
#include "turning.glsl"
#endif

void write_drawn() {
    vec3 diffuse = weighted_diffuse.rgb;
    vec3 specular = weighted_specular;
#ifdef TURNED
    turn(drawn.x, weighted_light / max(weighted_diffuse.a, LEAST_WEIGHT), diffuse, specular);
#endif
    write_luminance(diffuse, specular, weighted_diffuse.a, drawn.y);
}
