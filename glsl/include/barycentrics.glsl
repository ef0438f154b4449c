// Barycentric weights of corners 1 and 2 where the ray through an image point meets the plane of a triangle.
vec2 barycentrics(vec3 a, vec3 edge1, vec3 edge2, vec2 point) {
    vec2 ndc = point * frame.pixel - 1.0;
    vec3 direction = frame.forward + frame.right * ndc.x + frame.down * ndc.y;
    vec3 p = cross(direction, edge2);
    vec3 s = frame.eye - a;
    vec3 q = cross(s, edge1);
    return vec2(dot(s, p), dot(direction, q)) / dot(edge1, p);
}
