//! Plain stratified sampling: scrambled Sobol points [Burley20] mapped by the cosine.
//!
//! Every aligned power-of-two range of indices is stratified by itself and together with the range before it, so a round
//! as large as all rounds before it keeps the whole stratified. Scrambling makes each single point uniform, hence any
//! range without bias.

use super::radiance::Radiance;
use super::sample::{Gathered, Sample};
use crate::math::hemisphere::{Direction, Mixture};
use crate::math::sequence::Sequence;
use smallvec::SmallVec;
use std::ops::Range;

/// Rays whose steps are done together.
const AT_ONCE: usize = 32;

/// Traces the rays of the given indices.
pub fn gather<R: Radiance>(
    mixture: &Mixture<'_>,
    mut rays: Range<u32>,
    sequence: &Sequence,
    mut radiance: R,
    mut sink: impl FnMut(Sample),
) -> Gathered {
    let mut traced = 0;
    let mut met: SmallVec<[(u32, Direction, R::Met); AT_ONCE]> = SmallVec::new();
    loop {
        met.extend(rays.by_ref().take(AT_ONCE).map_while(|index| {
            let [u, v, ..] = sequence.point(index);
            let direction = mixture.at([u, v])?;
            let met = radiance.meet(index, direction.direction);
            Some((index, direction, met))
        }));
        let is_last = met.len() < AT_ONCE;
        traced += met.len() as u32;
        for (index, _, met) in &mut met {
            radiance.look_up(*index, met);
        }
        for (index, Direction { direction, measure }, met) in met.drain(..) {
            sink(Sample { direction, radiance: radiance.radiance(index, direction, met), weight: measure });
        }
        if is_last {
            return Gathered { rays: traced, samples: traced };
        }
    }
}
