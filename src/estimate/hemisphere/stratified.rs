//! Plain stratified sampling: scrambled Sobol points [Burley20] mapped by the cosine.
//!
//! Every aligned power-of-two range of indices is stratified by itself and together with the range before it, so a round
//! as large as all rounds before it keeps the whole stratified. Scrambling makes each single point uniform, hence any
//! range without bias.

use super::sample::{Gathered, Sample};
use crate::math::hemisphere::{Direction, Mixture};
use crate::math::sequence::Sequence;
use glam::Vec3;
use std::ops::Range;

/// Traces the rays of the given indices.
pub fn gather(
    mixture: &Mixture<'_>,
    rays: Range<u32>,
    sequence: &Sequence,
    mut radiance: impl FnMut(u32, Vec3) -> Vec3,
    mut sink: impl FnMut(Sample),
) -> Gathered {
    let mut traced = 0;
    for index in rays {
        let [u, v, ..] = sequence.point(index);
        let Some(Direction { direction, measure }) = mixture.at([u, v]) else { break };
        sink(Sample { direction, radiance: radiance(index, direction), weight: measure });
        traced += 1;
    }
    Gathered { rays: traced, samples: traced }
}
