//! What the engine tells the GPU: values written, and patches of triangles to redraw.
//!
//! The unit of update is a *patch*: the triangles drawn last and the triangles to draw now, both tiling the same
//! region of one face. A new value, a split and a changed hanging pattern are all patches; where values alone
//! changed, a patch is one triangle with `old == new`.

pub use super::memory::MemoryStats;
pub use crate::cache::drawn_mesh::DrawnTriangle;
pub use crate::cache::ids::{DrawnId, SlotId};
use crate::scene::FaceId;
use glam::{Vec3, Vec4};
use std::ops::Range;

/// Contents of a vertex slot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slot {
    /// Position, scene units (bit-identical to the scene's for base vertices).
    pub position: Vec3,
    /// Weight w: 1 valid, 0 invalid or not yet known; the rasteriser interpolates (w·D, w·S, w).
    pub weight: f32,
    /// Diffuse luminance D = Σ E/π, W·sr⁻¹·m⁻².
    pub diffuse: Vec3,
    /// Specular luminance S for the present camera, W·sr⁻¹·m⁻².
    pub specular: Vec3,
    /// Light vector of all light over π times the luminance of D, a vector of component 1 along the shading normal: how D changes as a normal
    /// map turns that; and how wide the light is, |V|/Φ. Only where there are normal maps, else 0.
    pub light_vector: Vec4,
}

/// One region of one face to redraw; the ranges index [`Update::patch_triangles`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Patch {
    /// The face.
    pub face: FaceId,
    /// Drawn triangles drawn last (empty the first time).
    pub old: Range<u32>,
    /// Drawn triangles to draw now.
    pub new: Range<u32>,
}

/// Pixels of a drawn drawn triangle, as the GPU counted them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DrawnPixels {
    /// The drawn triangle.
    pub drawn: DrawnId,
    /// How many pixels show it.
    pub pixels: u32,
}

/// What slots show: light, or what a debug view asks for in its place.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Shown {
    /// D and S of all light.
    #[default]
    Light,
    /// D of direct light alone, of the scene's light of this number, those of the same name and those that share a light group with them.
    Direct(u32),
    /// D and S of indirect light alone.
    Indirect,
    /// In place of D what is known: R is 1 without any value, G where it is a guess (from before the lights changed, or by what was
    /// found around), B where other geometry covers the vertex; S is 0.
    Knowledge,
}

/// What a debug view asks of each drawn triangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Question {
    /// The error expected of a pixel of it, relative to the image's mean: bits of a float.
    Error,
    /// The triangle of a light's own mesh that it is a part of: the largest above it below which the light was nowhere sampled, by
    /// its number. The light is named as by [`Shown::Direct`].
    LightMesh(u32),
}

/// What was asked of the drawn triangles in view.
#[derive(Clone, Debug, PartialEq)]
pub struct Answer {
    /// What was asked.
    pub question: Question,
    /// Triangles with their answers.
    pub of: Vec<(DrawnId, u32)>,
}

/// One batch of changes, applied in order: slots, then drawn triangles, then patches.
#[derive(Clone, Debug, Default)]
pub struct Update {
    /// The camera generation that it belongs to.
    pub generation: u32,
    /// Its number, rising.
    pub sequence: u64,
    /// Slots written.
    pub slots: Vec<(SlotId, Slot)>,
    /// Drawn triangles defined or redefined.
    pub drawn_triangles: Vec<(DrawnId, DrawnTriangle)>,
    /// Patches to redraw.
    pub patches: Vec<Patch>,
    /// DrawnTriangle lists of the patches.
    pub patch_triangles: Vec<DrawnId>,
    /// State of the engine after this batch.
    pub stats: EngineStats,
    /// Whether everything that waited to be shown is in it or in one before it ([`super::engine::Engine::settle`]).
    pub settled: bool,
    /// What its slots show.
    pub shown: Shown,
    /// What was asked of the drawn triangles, if this answers it.
    pub answer: Option<Answer>,
    /// Whether it holds all that those before it add up to, for a renderer that holds nothing ([`super::engine::Engine::whole`]).
    pub whole: bool,
}

impl Update {
    /// Triangles of a patch: those of its range of [`Self::patch_triangles`]; none for a range that is not there.
    #[must_use]
    pub fn listed(&self, range: &Range<u32>) -> &[DrawnId] {
        self.patch_triangles.get(range.start as usize..range.end as usize).unwrap_or_default()
    }
}

/// Running totals of the engine, for the log and the progress line.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EngineStats {
    /// Rays traced since the start.
    pub rays: u64,
    /// Vertices at which light has been traced (others take agreeing neighbours' word).
    pub vertices: u64,
    /// Drawn triangles.
    pub triangles: u64,
    /// Bytes held by the cache and the tables of the view, the queue and the publisher.
    pub cache_bytes: u64,
    /// How that stands to the budget.
    pub memory: MemoryStats,
    /// CPU time of the engine and its workers, seconds.
    pub cpu_seconds: f64,
    /// The part of it that the engine's own thread spent on jobs that it shares with other threads, seconds.
    pub own_job_seconds: f64,
    /// The part of it that taking in the present view took, seconds.
    pub view_cpu_seconds: f64,
    /// Estimated relative error of the image; `None` while nothing can be said.
    pub estimated_error: Option<f32>,
    /// Visible vertices that had no value when the view came.
    pub visible: u64,
    /// Those of them that have no value yet.
    pub unlit: u64,
    /// Vertices whose indirect light was gathered before the lights changed, and not since.
    pub outdated: u64,
    /// Visible faces whose specular luminance is for another eye.
    pub outdated_specular: u64,
    /// Every visible vertex has a first value.
    pub complete: bool,
    /// Nothing is left to do for this camera.
    pub converged: bool,
}
