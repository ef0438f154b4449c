//! What steers refinement.

use crate::estimate::hemisphere::Method;

pub use crate::cache::pieces::{Piece, Pieces};

/// How the next leaf to split is chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Priority {
    /// By expected drop of image error a ray.
    #[default]
    Error,
    /// At random among those that the thresholds ask for, as the paper does [FP03 §4.1.3].
    Random,
}

impl Priority {
    /// All choices with the names that options use.
    pub const NAMES: [(&'static str, Self); 2] = [("error", Self::Error), ("random", Self::Random)];
}

/// Thresholds and choices of a run.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// Seed of all random choices.
    pub seed: u64,
    /// Whether light that bounces is computed, too.
    pub indirect: bool,
    /// Whether indirect light that is shown leans on neighbours while rays are few.
    pub filter: bool,
    /// How the directions of gather rays are chosen.
    pub hemisphere: Method,
    /// Light groups at most: where there are more lights, small ones near each other share one.
    pub max_light_groups: usize,
    /// How the next leaf to split is chosen.
    pub priority: Priority,
    /// A leaf that covers no more pixels is not split.
    pub min_pixels: f32,
    /// Whether leaves go by the pixels of the image, where it is known; otherwise by what the GPU counts.
    pub listed: bool,
    /// Michelson contrast along an edge that counts as a perceptible discontinuity (`Priority::Random`).
    pub contrast: f32,
    /// Size of the smallest shadow that must not be missed, scene units.
    pub shadow_size: f32,
    /// Pixels of the smallest shadow that must not be missed; infinite if [`Self::shadow_size`] alone decides.
    pub shadow_pixels: f32,
    /// Luminance that is displayed as white, W·sr⁻¹·m⁻²; infinite if errors count alike everywhere.
    pub white: f32,
    /// Error of a pixel, relative to the image's mean, below which refinement stops.
    pub tolerance: f32,
    /// Pieces of the engine that are taken out.
    pub without: Pieces,
}
