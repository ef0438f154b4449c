//! What there is to say of the light that a pixel shows, as plain data: `penombre probe` prints it as JSON.

use glam::Vec3;
use serde::{Serialize, Serializer};

/// Everything about the surface that a pixel shows, but for its colours.
#[derive(Clone, Debug, Serialize)]
pub struct Explanation {
    /// The face.
    pub face: Face,
    /// The triangles of the hierarchy that hold the pixel's centre, from the face itself to a leaf.
    pub nodes: Vec<Node>,
    /// What the engine thinks of the leaf.
    pub leaf: Leaf,
    /// The triangle that is drawn there; none where the face was never drawn.
    pub triangle: Option<Triangle>,
    /// Its vertices, and the one inside it whose value it shows all over, if there is one.
    pub vertices: Vec<Vertex>,
    /// What is interpolated between them, in parts.
    pub light: PixelLight,
    /// Where the engine is.
    pub state: State,
}

/// A side of one of the scene's triangles.
#[derive(Clone, Debug, Serialize)]
pub struct Face {
    /// Number of the triangle in the scene, from 0.
    pub triangle: u32,
    /// `front` or `back`.
    pub side: &'static str,
    /// Its material.
    pub material: String,
    /// Phong exponent of its highlights; none where it has none, or others.
    pub shininess: Option<f32>,
    /// Perceptual roughness of its highlights of microfacets, without the texture; none where it has none, or others.
    pub roughness: Option<f32>,
}

/// A triangle of the hierarchy.
#[derive(Clone, Debug, Serialize)]
pub struct Node {
    /// Number of the node.
    pub node: u32,
    /// Splits above it.
    pub level: u8,
    /// Which part of its parent it is: at corner 0, 1 or 2, or 3 for the middle; none for a face.
    pub part: Option<u8>,
    /// Its corners, scene units.
    #[serde(serialize_with = "as_arrays")]
    pub corners: [Vec3; 3],
}

/// What the engine thinks of a leaf. Errors are standard errors of what its pixels show, as luminances, W·sr⁻¹·m⁻².
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Leaf {
    /// Pixels that it covers.
    pub pixels: f32,
    /// Largest Michelson contrast along one of its edges.
    pub contrast: f32,
    /// Error of interpolating between its corners.
    pub interpolation_error: f32,
    /// Error by noise at its corners.
    pub noise_error: f32,
    /// Error of indirect light; none while nothing tells.
    pub indirect_error: Option<f32>,
}

/// A drawn triangle.
#[derive(Clone, Debug, Serialize)]
pub struct Triangle {
    /// Its number.
    pub id: u32,
    /// The node that it is part of.
    pub node: u32,
    /// Whether it shows one value all over.
    pub flat: bool,
}

/// Diffuse luminance D and specular luminance S.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Light {
    /// D, W·sr⁻¹·m⁻².
    #[serde(serialize_with = "as_array")]
    pub diffuse: Vec3,
    /// S, W·sr⁻¹·m⁻².
    #[serde(serialize_with = "as_array")]
    pub specular: Vec3,
}

/// Where a vertex comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// A corner of the scene's triangles.
    Base,
    /// The midpoint of an edge.
    Midpoint,
    /// Inside a leaf, where a pixel sees it.
    Pixel,
}

/// A vertex of the drawn triangle: one of its normals.
#[derive(Clone, Debug, Serialize)]
pub struct Vertex {
    /// Number of the slot: a normal of a vertex, with its light.
    pub slot: u32,
    /// Number of the vertex.
    pub vertex: u32,
    /// Where it comes from.
    pub kind: Kind,
    /// The slots that it lies between.
    pub between: Vec<u32>,
    /// Position, scene units.
    #[serde(serialize_with = "as_array")]
    pub position: Vec3,
    /// Unit shading normal.
    #[serde(serialize_with = "as_array")]
    pub normal: Vec3,
    /// Whether light was traced or inferred there at all: else it is guessed by what is around it.
    pub visited: bool,
    /// Whether other geometry covers it.
    pub covered: bool,
    /// Whether it is taken for covered since it sees none of the light that its neighbours see.
    pub enclosed: bool,
    /// Barycentric weight of the pixel's centre.
    pub barycentric: f32,
    /// Weight in interpolation: 1, or next to nothing where it is covered or guessed, 0 where nothing is known.
    pub weight: f32,
    /// Share of the pixel's light that is its own; those of all vertices add up to 1.
    pub share: f32,
    /// Each light group that is on.
    pub lights: Vec<LightPart>,
    /// Indirect light.
    pub indirect: Indirect,
    /// What it shows beyond these parts: they are computed now, it shows what it did when it was last evaluated.
    pub unaccounted: Light,
    /// What it shows: the sum.
    pub shown: Light,
    /// Standard error of the luminance of direct D, W·sr⁻¹·m⁻²: penumbrae, and lights that are not traced yet.
    pub direct_error: f32,
    /// Updates to the GPU since which its value has certainly not changed: the age of what is shown.
    pub unchanged_updates: Option<u32>,
}

/// How the visible fraction of a light is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Known {
    /// By rays.
    Traced,
    /// Taken over from corners that agree.
    Inferred,
    /// Put off, as too faint or too sure to be worth a ray yet: a guess by what others around see.
    Deferred,
    /// Guessed at a vertex that was never visited.
    Guessed,
    /// Not at all.
    Unknown,
}

/// What a light group adds at a vertex.
#[derive(Clone, Debug, Serialize)]
pub struct LightPart {
    /// Names of its lights: one, unless several share a visible fraction.
    pub lights: Vec<String>,
    /// Visible fraction.
    pub visible: f32,
    /// How that is known.
    pub known: Known,
    /// Points of the light that were traced, a ray each.
    pub points: u32,
    /// What it adds.
    #[serde(flatten)]
    pub light: Light,
    /// Standard error of the luminance of D, W·sr⁻¹·m⁻².
    pub error: f32,
}

/// Indirect light at a vertex.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Indirect {
    /// Rays that the vertex gathered under the present lights.
    pub rays: u32,
    /// What it gathered itself.
    pub gathered: Option<Light>,
    /// Standard error of the luminance of that D, W·sr⁻¹·m⁻².
    pub gathered_error: Option<f32>,
    /// What vertices around predict.
    pub predicted: Option<Light>,
    /// D that is kept, of both by what they are worth, W·sr⁻¹·m⁻².
    #[serde(serialize_with = "as_array")]
    pub kept: Vec3,
    /// Standard error of its luminance, W·sr⁻¹·m⁻².
    pub kept_error: f32,
    /// Whether that is a guess, from before the lights changed or by coarser vertices.
    pub kept_is_guess: bool,
    /// Which D is shown: `smoothed`, `kept`, or `expected` where nothing is known.
    pub shown_as: &'static str,
    /// What is shown.
    #[serde(flatten)]
    pub light: Light,
}

/// What a pixel shows of light: the vertices' parts by their shares.
#[derive(Clone, Debug, Default, Serialize)]
pub struct PixelLight {
    /// By light group.
    pub lights: Vec<NamedLight>,
    /// Indirect light.
    pub indirect: Light,
    /// See [`Vertex::unaccounted`].
    pub unaccounted: Light,
    /// All of it.
    pub sum: Light,
}

/// Light of a light group.
#[derive(Clone, Debug, Serialize)]
pub struct NamedLight {
    /// Names of its lights.
    pub lights: Vec<String>,
    /// What it adds.
    #[serde(flatten)]
    pub light: Light,
}

/// Where the engine is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct State {
    /// Number of the view, from 1.
    pub view: u32,
    /// Number of the last update to the GPU.
    pub update: u64,
    /// Rays traced so far.
    pub rays: u64,
    /// Mean luminance of the image, W·sr⁻¹·m⁻².
    pub image_mean: f32,
    /// Estimated relative error of the image; none while nothing can be said.
    pub estimated_error: Option<f32>,
}

impl Light {
    /// The sum of this and another light times a factor.
    pub(super) fn add(&mut self, other: Self, factor: f32) {
        self.diffuse += other.diffuse * factor;
        self.specular += other.specular * factor;
    }
}

impl PixelLight {
    /// The light of vertices by their shares.
    pub(super) fn of(vertices: &[Vertex]) -> Self {
        let Some(first) = vertices.first() else { return Self::default() };
        let named = |part: &LightPart| NamedLight { lights: part.lights.clone(), light: Light::default() };
        let mut all = Self { lights: first.lights.iter().map(named).collect(), ..Self::default() };
        for vertex in vertices {
            for (sum, part) in all.lights.iter_mut().zip(&vertex.lights) {
                sum.light.add(part.light, vertex.share);
            }
            all.indirect.add(vertex.indirect.light, vertex.share);
            all.unaccounted.add(vertex.unaccounted, vertex.share);
            all.sum.add(vertex.shown, vertex.share);
        }
        // As the luminance pass does where a pixel's centre lies a little outside of the triangle.
        let Light { diffuse, specular } = &mut all.sum;
        (*diffuse, *specular) = (diffuse.max(Vec3::ZERO), specular.max(Vec3::ZERO));
        all
    }
}

/// Writes a vector as an array.
///
/// # Errors
/// The serializer's.
pub fn as_array<S: Serializer>(vector: &Vec3, serializer: S) -> Result<S::Ok, S::Error> {
    vector.to_array().serialize(serializer)
}

fn as_arrays<S: Serializer>(vectors: &[Vec3; 3], serializer: S) -> Result<S::Ok, S::Error> {
    vectors.map(|vector| vector.to_array()).serialize(serializer)
}
