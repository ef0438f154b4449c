// What all stages read: one uniform block, and from it the scene and the light by device address
// (docs/method/updates.md). src/pass/shared.rs holds the host's side of these structs and is checked against them at
// build time.
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_scalar_block_layout : require

const uint NONE = 0xffffffffu;
const uint MAX_LEVELS = 15;

// A triangle by its id.
struct Triangle {
    uvec3 corners;
    uint material;
    vec2 uv[3];
    uint padding[2]; // to whole texels, glsl/include/scene.glsl
};

// A triangle in drawing order: those without mask first.
struct VisibilityTriangle {
    uvec3 corners;
    uint id;
};

// A face whose distance is that of a plane: points p with normal . p = offset.
struct CoplanarFace {
    vec3 normal;
    float offset;
    uint face;
    float towards; // 1 where the face looks along the normal, else -1
};

// Texture entries, or NONE. Reflectances are linear, ke is radiance in W/sr/m2.
struct Material {
    vec3 kd;
    uint map_kd;
    vec3 ks;
    uint map_d;
    vec3 ke;
    uint map_ke;
    vec3 f0; // what slots are lit with, of the metallic-roughness model
    uint map_metallic;
    float metallic; // negative for Phong
    float roughness;
    uint map_roughness;
    uint map_normal;
    float normal_scale;
    uint padding[3]; // to whole texels
};

// A texture's mip chain, index of each level's first texel; looked up at matrix * uv + offset.
const uint HELD_U = 8u;          // outside of [0, 1] its edge goes on along u
const uint HELD_V = 16u;
const uint MIRRORED_U = 32u;     // or, where this is set too, the image turned over
const uint MIRRORED_V = 64u;
const uint SHARED_EXPONENT = 2u; // encoding of its texels, scene::texture::Encoding
const uint LINEAR = 4u;
struct Texture {
    uvec2 extent;
    uint levels;
    uint flags;
    mat2 matrix;
    vec2 offset;
    uint first[MAX_LEVELS];
    uint padding[3]; // to whole texels
};

// A vertex slot: weight 1 valid, 0 invalid; D and S in W/sr/m2.
struct Slot {
    vec3 position;
    float weight;
    vec3 diffuse;
    vec3 specular;
};

struct DrawnTriangle {
    uvec3 slots;
    uint face;
    uint flat_slot; // whose value shows all over, or NONE
};

// A node of a face's tree (src/pass/lookup.rs): the first of its four children, or NONE, and then its triangles.
struct LookupNode {
    uint child;
    uint stamp;     // of the frame that draws its triangles
    uint codes;     // a byte a triangle: where its corners lie in the node
    uint drawn_triangles[4]; // NONE where there are fewer
};

// The tree of a face: its root, or NONE, and the stamp of the frame that last draws a part of it.
struct LookupRoot {
    uint node;
    uint stamp;
};

layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Positions { vec4 at[]; }; // a: 1
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Triangles { Triangle at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer VisibilityTriangles { VisibilityTriangle at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Marks { vec3 at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer CoplanarFaces { CoplanarFace at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Materials { Material at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Textures { Texture at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Texels { uint at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer Slots { Slot at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer DrawnTriangles { DrawnTriangle at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer DrawnList { uint at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer LookupNodes { LookupNode at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer LookupRoots { LookupRoot at[]; };
layout(buffer_reference, scalar, buffer_reference_align = 4) readonly buffer References { uint at[]; };

struct Frame {
    mat4 clip_from_world;
    Positions positions;
    Triangles triangles;
    VisibilityTriangles visibility_triangles;
    CoplanarFaces coplanar;
    Materials materials;
    Textures textures;
    Texels texels;
    uvec2 colours; // address of three vertex colours a triangle, 0 without any
    uvec2 light_vectors; // address of one a slot, where normal maps turn light
    uvec2 normals; // address of three shading normals a triangle, 0 where none is needed
    Slots slots;
    DrawnTriangles drawn_triangles;
    DrawnList drawn_list;
    Marks marks;
    LookupNodes lookup_nodes;
    LookupRoots lookup_roots;
    References list_references; // stencil references, where draws export them
    References mark_references;
    uvec2 drawn_pixels;          // address of a counter a drawn triangle
    vec3 eye;
    vec3 forward;   // unit
    vec3 right;     // the image's edges are at forward +- right, forward +- down
    vec3 down;
    vec2 pixel;     // size of a pixel in NDC
    vec2 jitter;    // pixels
    float luminance_scale; // stored D and S are true values times this
    float emission_scale;  // likewise L_e
    float exposure;        // factor
    uint emits_back;       // whether emissive triangles emit on both sides
    float filter_width;    // of the square that textures are filtered over, pixels
    vec2 depth_of_inverse;  // depth is x / distance along the view + y
    float background_depth; // farther than any drawn triangle, nearer than nothing
    uint lookup_stamp;      // of the drawn triangles to look up; 0 for all
    uint sky;               // texture entry of the environment's picture, or NONE
    vec3 sky_factor;        // what its radiance counts times, emission_scale included
    vec3 sky_axes[3];       // directions of what lies right of its middle, above, in its middle
    vec3 sun_direction;     // unit, to its middle
    float sun_reach;        // distance between the ends of unit directions to its middle and to its edge
    vec3 sun_radiance;      // times emission_scale
    uint padding;           // to a multiple of an address
};

layout(set = 0, binding = 0, scalar) uniform FrameBlock { Frame frame; };
