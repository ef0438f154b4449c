//! The visible fraction of a light at a point: taken over from elsewhere, or sampled in rounds that go on where the last
//! one stopped.

use glam::Vec3;

/// What a vertex knows of one light's visibility.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Visibility {
    /// Points of the light tested so far (a delta light needs one); 0 while nothing was traced.
    pub points: u32,
    /// How many of them were visible.
    hits: u32,
    /// Visibility of the newest points, bit 0 of the first word the newest: bit i is point `points - 1 - i` of the sequence. (Two
    /// words, as one of 64 bits would cost padding.)
    newest: [u32; 2],
    /// How the value came about.
    pub origin: Origin,
    /// Visible fraction where it was taken over from coarser vertices, in 1/255.
    inherited: u8,
}

/// How a vertex came to know a light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Origin {
    /// Nothing is known.
    #[default]
    Unknown,
    /// Taken over from corners that agree.
    Inferred,
    /// Guessed from what others around see: too faint, or too sure, to be worth a ray yet.
    Deferred,
    /// Traced.
    Sampled,
}

/// How many points a [`Visibility`] remembers one by one; older ones live on in the sums.
pub const REMEMBERED: u32 = u64::BITS;

/// Guessed fraction below which light counts as hidden for the most part.
const UNLIKELY: f32 = 0.5;

impl Visibility {
    /// A value taken over, not traced.
    #[must_use]
    pub fn taken_over(origin: Origin, fraction: f32) -> Self {
        Self { points: 0, hits: 0, newest: [0; 2], origin, inherited: (fraction * 255.0).round() as u8 }
    }

    /// Notes the visibility of the next point.
    pub fn push(&mut self, visible: bool) {
        self.points += 1;
        self.hits += u32::from(visible);
        let mask = self.mask() << 1 | u64::from(visible);
        self.newest = [mask as u32, (mask >> 32) as u32];
        self.origin = Origin::Sampled;
    }

    fn mask(self) -> u64 {
        let [low, high] = self.newest;
        u64::from(high) << 32 | u64::from(low)
    }

    /// The remembered points, newest first: index in the sequence, and whether the point is visible.
    pub fn remembered(self) -> impl Iterator<Item = (u32, bool)> {
        let mask = self.mask();
        (0..self.points.min(REMEMBERED)).map(move |i| (self.points - 1 - i, mask >> i & 1 == 1))
    }

    /// Share of the remembered points that are visible where the one `distance` before was not or the other way round, with half a
    /// point of doubt; `None` if there are not enough to tell.
    #[must_use]
    pub fn change_after(self, distance: u32) -> Option<f32> {
        const LEAST_PAIRS: u32 = 4;
        let pairs = self.points.min(REMEMBERED).checked_sub(distance).filter(|&pairs| pairs >= LEAST_PAIRS)?;
        let mask = self.mask();
        let changed = (mask ^ mask >> distance) & (u64::MAX >> (REMEMBERED - pairs));
        Some((changed.count_ones() as f32 + 0.5) / (pairs + 1) as f32)
    }

    /// Visible fraction of the light: over all points, or as taken over.
    #[must_use]
    pub fn fraction(self) -> f32 {
        if self.origin != Origin::Sampled {
            return f32::from(self.inherited) / 255.0;
        }
        self.hits as f32 / self.points.max(1) as f32
    }

    /// Whether it was found that some of the light is visible and some is not.
    #[must_use]
    pub fn is_partial(self) -> bool {
        self.origin == Origin::Sampled && self.hits > 0 && self.hits < self.points
    }

    /// Whether it is guessed that little of the light is visible.
    #[must_use]
    pub fn is_unlikely(self) -> bool {
        self.origin == Origin::Deferred && self.fraction() < UNLIKELY
    }

    /// Whether it is more than a guess.
    #[must_use]
    pub const fn is_settled(self) -> bool {
        matches!(self.origin, Origin::Sampled | Origin::Inferred)
    }

    /// Whether anything is known.
    #[must_use]
    pub fn is_known(self) -> bool {
        self.origin != Origin::Unknown
    }
}

/// What a slot (one normal of a vertex) knows of an area light: sums over all traced points of all rounds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AreaSum {
    /// Σ of v L g over the points, W·m⁻²: the irradiance samples of visible points.
    pub visible: Vec3,
    /// Σ of the luminance of L g, W·m⁻²: the same as if all were visible.
    pub unoccluded: f32,
}
