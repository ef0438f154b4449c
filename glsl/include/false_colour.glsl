// Colours that stand for numbers in debug views, as displayed (sRGB).

// Lines of a mesh.
const vec3 LINE = vec3(1.0, 0.85, 0.3);

// A colour for each number, other ones for those beside it (Jarzynski and Olano's hash pcg, a byte a channel); not too dark.
vec3 colour_of_number(uint number) {
    uint state = number * 747796405u + 2891336453u;
    uint word = ((state >> ((state >> 28) + 4u)) ^ state) * 277803737u;
    uint hash = (word >> 22) ^ word;
    return 0.25 + 0.75 * vec3(uvec3(hash, hash >> 8, hash >> 16) & 255u) / 255.0;
}

// Through dark blue, green and yellow to red, at 0 to 1.
vec3 heat(float share) {
    float x = clamp(share, 0.0, 1.0);
    return clamp(vec3(3.0 * x - 1.0, min(4.0 * x, 4.0 - 3.6 * x), 1.0 - 2.5 * x) * (0.3 + 0.7 * min(2.0 * x + 0.2, 1.0)), 0.0, 1.0);
}

// Splits above a drawn triangle: grey where there are none.
vec3 colour_of_level(uint level) {
    const float most = 10.0;
    return level == 0u ? vec3(0.35) : heat(float(level) / most);
}

// An error relative to the image's mean, by its logarithm: 0.1 % dark blue, 100 % red.
vec3 colour_of_error(float error) {
    const float decades = 3.0;
    return heat(1.0 + log2(max(error, 1e-6)) / (decades * log2(10.0)));
}

// refine::update::Shown::Knowledge: red without a value, yellow a guess, blue covered, grey the rest.
vec3 colour_of_knowledge(vec3 shares) {
    vec3 colour = mix(vec3(0.35), vec3(0.95, 0.8, 0.1), clamp(shares.g, 0.0, 1.0));
    colour = mix(colour, vec3(0.2, 0.35, 1.0), clamp(shares.b, 0.0, 1.0));
    return mix(colour, vec3(0.9, 0.1, 0.1), clamp(shares.r, 0.0, 1.0));
}
