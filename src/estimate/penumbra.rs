//! How much less than independent points of a light stratified ones err in its penumbra: measured, light by light.
//!
//! A penumbra's edge crosses the light along a line, so that points of a (0, 2)-sequence err by n^-3/4, not n^-1/2: their variance
//! falls 64 times further below that of independent points from 16 to 65,536. Behind leaves or a lattice it does not. As in
//! [`stratification`](super::stratification), two rounds of as many points at a vertex tell the variance of their common mean by
//! (a − b)²/4; pooled over the vertices of a light that gives the gain.

/// Points of the first rounds that are compared, as a power of two: with fewer, doubt outweighs what they say.
const FIRST: u32 = 4;
/// Powers of two of points from there on.
const LEVELS: usize = 17;
/// Gain of the first level where nothing is measured yet, as it is told by rounds (with their bias).
const USUAL: f32 = 0.55;
/// The gain of a level against that of the one before, at a straight edge: n^-1/2.
const STEEPEST: f32 = std::f32::consts::FRAC_1_SQRT_2;
/// Rounds that what is expected counts for beside those measured.
const PRIOR: f32 = 16.0;

/// What a slot and a light's points say of the visible share of its light.
#[derive(Clone, Copy, Debug)]
pub struct Round {
    /// Number of points.
    pub points: u32,
    /// Visible share of the light, 0 to 1.
    pub share: f32,
}

/// Differences of rounds at one number of points.
#[derive(Clone, Copy, Debug, Default)]
struct Tally {
    /// Σ of variances of the common mean that differences tell.
    found: f32,
    /// Σ of the variances of as many independent points.
    independent: f32,
    rounds: f32,
}

/// What the rounds of each light have told.
#[derive(Clone, Debug, Default)]
pub struct Penumbrae {
    lights: Vec<[Tally; LEVELS]>,
}

impl Penumbrae {
    /// For a number of light groups.
    #[must_use]
    pub fn new(lights: usize) -> Self {
        Self { lights: vec![Default::default(); lights] }
    }

    /// Notes what the points before said at a vertex, and what as many more say; others tell nothing and are left out.
    pub fn note(&mut self, light: u32, before: Round, more: Round) {
        let both = before.points + more.points;
        let share = (before.share + more.share) * 0.5;
        if before.points != more.points || both < 1 << FIRST || share <= 0.0 || share >= 1.0 {
            return;
        }
        let tally = &mut self.lights[light as usize][level(both)];
        tally.found += 0.25 * (before.share - more.share).powi(2);
        tally.independent += share * (1.0 - share) / both as f32;
        tally.rounds += 1.0;
    }

    /// Forgets what rounds of a light have told.
    pub fn forget(&mut self, light: u32) {
        self.lights[light as usize] = Default::default();
    }

    /// Variance of the mean of a number of points of a light against that of independent ones.
    #[must_use]
    pub fn gain(&self, light: u32, points: u32) -> f32 {
        let (mut before, mut now) = (USUAL / STEEPEST, USUAL / STEEPEST);
        for tally in &self.lights[light as usize][..=level(points)] {
            before = now;
            now *= STEEPEST;
            if tally.independent > 0.0 {
                let measured = tally.found / tally.independent;
                now = (measured * tally.rounds + now * PRIOR) / (tally.rounds + PRIOR);
            }
        }
        // Two rounds together are stratified more finely than each: where the variance falls as n^-p, they tell 2^p − 1 times too much.
        let step = (now / before).clamp(STEEPEST, 1.0);
        now / (2.0 / step - 1.0)
    }

    /// Bytes held.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.lights.capacity() * size_of::<[Tally; LEVELS]>()
    }
}

fn level(points: u32) -> usize {
    let power = points.checked_ilog2().unwrap_or(0).saturating_sub(FIRST) as usize;
    power.min(LEVELS - 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::combine;
    use crate::math::sequence::Sequence;

    /// Share of the points from `first` on, `count` of them, that are visible.
    fn share(sequence: &Sequence, first: u32, count: u32, visible: impl Fn(u32, [f32; 2]) -> bool) -> f32 {
        let sees = |i| {
            let [u, v, ..] = sequence.point(i);
            visible(i, [u, v])
        };
        (first..first + count).filter(|&i| sees(i)).count() as f32 / count as f32
    }

    /// Variance of the mean of `points` over vertices, against what their rounds tell.
    fn told_and_true(points: u32, visible: impl Fn(u32, u64, [f32; 2]) -> bool) -> [f32; 2] {
        let mut pool = Penumbrae::new(1);
        let (mut square, vertices) = (0.0, 300);
        for vertex in 0..vertices {
            let sequence = Sequence::new(combine(7, vertex));
            let of = |first, count| share(&sequence, first, count, |i, at| visible(i, vertex, at));
            let mut so_far = 1 << (FIRST - 1);
            while so_far < points {
                let rounds = [of(0, so_far), of(so_far, so_far)].map(|share| Round { points: so_far, share });
                pool.note(0, rounds[0], rounds[1]);
                so_far *= 2;
            }
            square += (of(0, points) - 0.3).powi(2) / vertices as f32;
        }
        [pool.gain(0, points), square / (0.3 * 0.7 / points as f32)]
    }

    #[test]
    fn rounds_tell_the_error_at_an_edge() {
        // A slanted line that leaves 0.3 of the square.
        for points in [64, 512, 4096] {
            let [told, truth] = told_and_true(points, |_, _, [u, v]| u + 0.4 * (v - 0.5) < 0.3);
            assert!((0.5..2.0).contains(&(told / truth)), "{points}: {told} for {truth}");
            assert!(told < 1.6 / (points as f32).sqrt(), "{points}: {told}");
        }
    }

    #[test]
    fn rounds_tell_the_error_behind_leaves() {
        let noise = |i, vertex, _: [f32; 2]| Sequence::new(vertex).independent(i)[0] < 0.3;
        let [told, truth] = told_and_true(1024, noise);
        assert!((0.7..1.4).contains(&(told / truth)), "{told} for {truth}");
    }

    #[test]
    fn without_measurements_an_edge_is_expected() {
        let mut pool = Penumbrae::new(2);
        assert!((pool.gain(0, 16) - 0.3).abs() < 0.01 && (pool.gain(1, 1 << 16) - 0.3 / 64.0).abs() < 1e-3);
        let round = |points, share| Round { points, share };
        // Rounds of unlike size, full light and none tell nothing.
        pool.note(0, round(64, 0.2), round(32, 0.8));
        pool.note(0, round(64, 1.0), round(64, 1.0));
        pool.note(0, round(64, 0.0), round(64, 0.0));
        assert_eq!(pool.gain(0, 128), pool.gain(1, 128));
        (0..1000).for_each(|_| pool.note(0, round(64, 0.2), round(64, 0.8)));
        assert!(pool.gain(0, 128) > 10.0 * pool.gain(1, 128));
        assert!(pool.gain(0, 256) > 5.0 * pool.gain(1, 256), "what was measured is expected beyond");
    }
}
