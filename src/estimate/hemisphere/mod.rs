//! Gathering light over the hemisphere above a point: three methods behind one interface.
//!
//! A method chooses directions, asks for the radiance that arrives from them and hands out weighted samples. It knows
//! neither scene nor rays, so it is tested on radiances whose integrals are known (tests/estimate/hemisphere.rs). All work in the
//! square of a [`Mixture`], so that one set of rays serves all normals of a vertex.

mod adaptive;
mod cells;
mod paper;
mod radiance;
mod sample;
mod stratified;

use crate::math::hemisphere::{Density, Mixture};
use crate::math::sequence::Sequence;
use glam::Vec3;
pub use paper::Thresholds;
pub use radiance::Radiance;
pub use sample::{Gathered, Sample};
use std::ops::Range;

/// How directions are chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Method {
    /// A progressive low-discrepancy sequence with the density of the cosine. Any range of rays is without bias, whatever
    /// was traced before: rounds accumulate.
    #[default]
    Stratified,
    /// Cells of equal projected solid angle, split where the light varies most. Less error for its rays, but biased
    /// by choosing cells and measuring them with the same rays.
    Adaptive,
    /// The paper's: cells of equal solid angle, split until they are homogeneous [FP03 §4.2]. Biased likewise, and by
    /// stopping early.
    Paper,
}

impl Method {
    /// All methods with the names that options use.
    pub const NAMES: [(&'static str, Self); 3] =
        [("stratified", Self::Stratified), ("adaptive", Self::Adaptive), ("paper", Self::Paper)];

    /// Its name in [`Self::NAMES`].
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Stratified => "stratified",
            Self::Adaptive => "adaptive",
            Self::Paper => "paper",
        }
    }
}

/// Gathers the light above the horizon of any of the unit `normals` of a point.
///
/// `rays` are indices into `sequence`. [`Method::Stratified`] traces exactly those; the others trace at most as many, and
/// the range only decides which random numbers they use. `radiance` is asked once a ray with the ray's index and unit
/// direction. Of the point of that index, the first two coordinates may be spent here; the others, and those of the other
/// sets, are free for what happens at the hit. `sink` takes the samples.
///
/// `Stratified` allocates nothing. Nothing is traced without normals.
pub fn gather(
    method: Method,
    normals: &[Vec3],
    rays: Range<u32>,
    sequence: &Sequence,
    mut radiance: impl Radiance,
    sink: impl FnMut(Sample),
) -> Gathered {
    if normals.is_empty() || rays.is_empty() {
        return Gathered::default();
    }
    let cosine = Mixture::new(normals, Density::Cosine);
    let arriving = |index, direction| radiance.arriving(index, direction);
    match method {
        Method::Stratified => stratified::gather(&cosine, rays, sequence, radiance, sink),
        Method::Adaptive => adaptive::gather(&cosine, rays, sequence, arriving, sink),
        Method::Paper => gather_as_paper(&Thresholds::default(), normals, rays, sequence, arriving, sink),
    }
}

/// [`gather`] by [`Method::Paper`] with thresholds of one's own.
pub fn gather_as_paper(
    thresholds: &Thresholds,
    normals: &[Vec3],
    rays: Range<u32>,
    sequence: &Sequence,
    radiance: impl FnMut(u32, Vec3) -> Vec3,
    sink: impl FnMut(Sample),
) -> Gathered {
    let uniform = Mixture::new(normals, Density::Uniform);
    paper::gather(thresholds, &uniform, rays, sequence, radiance, sink)
}
