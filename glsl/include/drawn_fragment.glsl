// What luminance.vert sends of a drawn triangle.
layout(location = 0) in vec3 weighted_diffuse;
layout(location = 1) in vec3 weighted_specular;
layout(location = 2) in float weight;
layout(location = 3) flat in uint face;
layout(location = 4) flat in uint drawn;
