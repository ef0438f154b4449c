// Where a pixel lies in the mesh of its face: descends the face's tree by barycentrics.

// What a pixel found: the triangle, the weights of its corners; NONE without any.
struct Found {
    uint drawn_id;
    vec3 weights;
};

// A corner of a triangle in its node: one of the node's corners (0 to 2), or the middle of the edge opposite one (3 to 5).
vec3 place(uint code) {
    vec3 corner = vec3(equal(uvec3(code % 3u), uvec3(0u, 1u, 2u)));
    return code < 3u ? corner : (1.0 - corner) * 0.5;
}

// Weights of a triangle's corners at a point of its node.
vec3 weights_in(uint code, vec3 point) {
    mat3 corners = mat3(place(code / 36u), place(code / 6u % 6u), place(code % 6u));
    return inverse(corners) * point;
}

// The triangle of a node that a point lies in, or is nearest to.
Found among(LookupNode node, vec3 point) {
    Found best = Found(NONE, vec3(0.0));
    float inside = -1e30;
    for (uint i = 0u; i < 4u && node.drawn_triangles[i] != NONE; ++i) {
        vec3 weights = weights_in(node.codes >> (8u * i) & 255u, point);
        float least = min(weights.x, min(weights.y, weights.z));
        if (least > inside) {
            inside = least;
            best = Found(node.drawn_triangles[i], weights);
        }
    }
    return best;
}

// Barycentric weights of the pixel's centre in a triangle.
vec3 in_face(uint triangle) {
    uvec3 corners = triangle_corners(triangle);
    vec3 a = position_at(corners.x);
    vec2 b = barycentrics(a, position_at(corners.y) - a, position_at(corners.z) - a,
                          gl_FragCoord.xy + frame.jitter);
    return vec3(1.0 - b.x - b.y, b);
}

// Which child a point of a node lies in (that of a corner, or the middle one), and the point in it.
uint descend(inout vec3 point) {
    for (uint i = 0u; i < 3u; ++i) {
        if (point[i] >= 0.5) {
            point = 2.0 * point - vec3(equal(uvec3(i), uvec3(0u, 1u, 2u)));
            return i;
        }
    }
    point = 1.0 - 2.0 * point;
    return 3u;
}

// The triangle at this pixel, if it is to be looked up. (After a discard, shaders go on: nothing is discarded here.)
Found find() {
    Found nothing = Found(NONE, vec3(0.0));
    uint id = texelFetch(ids, ivec2(gl_FragCoord.xy), 0).x;
    if (id == 0u) {
        return nothing;
    }
    LookupRoot root = frame.lookup_roots.at[id - 1u];
    uint stamp = frame.lookup_stamp;
    if (root.node == NONE || (stamp != 0u && root.stamp != stamp)) {
        return nothing;
    }
    vec3 point = in_face((id - 1u) >> 1);
    uint node = root.node;
    for (uint child = frame.lookup_nodes.at[node].child; child != NONE; child = frame.lookup_nodes.at[node].child) {
        node = child + descend(point);
    }
    if (stamp != 0u && frame.lookup_nodes.at[node].stamp != stamp) {
        return nothing;
    }
    return among(frame.lookup_nodes.at[node], point);
}

// Its luminance.
void write_found(Found found) {
    uint flat_slot = drawn_triangle_flat_slot(found.drawn_id);
    vec3 diffuse = vec3(0.0);
    vec3 specular = vec3(0.0);
    float weight = 0.0;
    for (uint i = 0u; i < 3u; ++i) {
        uint slot = flat_slot == NONE ? drawn_triangle_slot(found.drawn_id, i) : flat_slot;
        float share = found.weights[i] * slot_weight(slot);
        weight += share;
        diffuse += share * slot_diffuse(slot);
        specular += share * slot_specular(slot);
    }
    write_luminance(diffuse, specular, weight, found.drawn_id);
}
