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
    /// Visible fraction where it was taken over from coarser vertices, in [`GUESSES`] parts.
    inherited: u8,
}

/// How a vertex came to know a light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Origin {
    /// Nothing is known.
    #[default]
    Unknown,
    /// Guessed from what others around see: too faint, or too sure, to be worth a ray yet.
    Deferred,
    /// Taken over from corners that agree.
    Inferred,
    /// Traced.
    Sampled,
}

/// How many points a [`Visibility`] remembers one by one; older ones live on in the sums.
pub const REMEMBERED: u32 = u64::BITS;

/// Parts in which a guessed fraction is kept: as many as there are bytes for.
const GUESSES: u8 = BYTES - FIRST_GUESS - 1;
/// The byte of the guess that nothing is visible, after those of nothing known, of one hidden and one visible point, and of
/// no and full visibility inferred.
const FIRST_GUESS: u8 = 5;
/// Bytes that say what is known, from 0 on.
pub const BYTES: u8 = 253;
/// Bits of a word that hold the number of points, and how many the others hold.
const COUNT_BITS: u32 = 6;
const POINTS_A_WORD: u32 = u64::BITS - COUNT_BITS;

/// The shortest form that holds a [`Visibility`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stored {
    /// Less than [`BYTES`].
    Byte(u8),
    /// The number of points in the low bits, what each found above them, the newest lowest.
    Word(u64),
    /// None shorter than itself.
    Whole,
}

/// Guessed fraction below which light counts as hidden for the most part.
const UNLIKELY: f32 = 0.5;

impl Visibility {
    /// A value taken over, not traced.
    #[must_use]
    pub fn taken_over(origin: Origin, fraction: f32) -> Self {
        Self { points: 0, hits: 0, newest: [0; 2], origin, inherited: (fraction * f32::from(GUESSES)).round() as u8 }
    }

    /// The shortest form that holds it.
    #[must_use]
    pub fn stored(self) -> Stored {
        match (self.origin, self.points) {
            (Origin::Unknown, _) => Stored::Byte(0),
            (Origin::Sampled, 1) => Stored::Byte(1 + self.hits as u8),
            (Origin::Inferred, _) if self.inherited == 0 => Stored::Byte(3),
            (Origin::Inferred, _) if self.inherited == GUESSES => Stored::Byte(4),
            (Origin::Deferred, _) => Stored::Byte(FIRST_GUESS + self.inherited),
            (Origin::Sampled, points) if points <= POINTS_A_WORD => {
                Stored::Word(self.mask() << COUNT_BITS | u64::from(points))
            }
            _ => Stored::Whole,
        }
    }

    /// What a [`Stored::Byte`] says.
    #[must_use]
    pub fn of_byte(byte: u8) -> Self {
        match byte {
            0 => Self::default(),
            1 | 2 => {
                let hits = u32::from(byte - 1);
                Self { points: 1, hits, newest: [hits, 0], origin: Origin::Sampled, inherited: 0 }
            }
            3 => Self { origin: Origin::Inferred, ..Self::default() },
            4 => Self { origin: Origin::Inferred, inherited: GUESSES, ..Self::default() },
            _ => Self { origin: Origin::Deferred, inherited: byte - FIRST_GUESS, ..Self::default() },
        }
    }

    /// What a [`Stored::Word`] says.
    #[must_use]
    pub const fn of_word(word: u64) -> Self {
        let (points, mask) = ((word & ((1 << COUNT_BITS) - 1)) as u32, word >> COUNT_BITS);
        let newest = [mask as u32, (mask >> 32) as u32];
        Self { points, hits: mask.count_ones(), newest, origin: Origin::Sampled, inherited: 0 }
    }

    /// All of it, where no shorter form holds it: points, visible ones, the newest, how the value came about and what it was.
    #[must_use]
    pub fn to_words(self) -> [u32; 5] {
        let Self { points, hits, newest: [low, high], origin, inherited } = self;
        [points, hits, low, high, origin as u32 | u32::from(inherited) << 8]
    }

    /// What these words say; `None` if nothing can be so.
    #[must_use]
    pub fn of_words([points, hits, low, high, rest]: [u32; 5]) -> Option<Self> {
        let origins = [Origin::Unknown, Origin::Deferred, Origin::Inferred, Origin::Sampled];
        let origin = *origins.get((rest & 255) as usize)?;
        let inherited = u8::try_from(rest >> 8).ok().filter(|&inherited| inherited <= GUESSES)?;
        let is_sampled = origin == Origin::Sampled;
        (hits <= points && is_sampled == (points > 0)).then_some(Self {
            points,
            hits,
            newest: [low, high],
            origin,
            inherited,
        })
    }

    /// Which of two values of one vertex tells more: that of more points, else the one that is less of a guess.
    #[must_use]
    pub const fn worth(self) -> (u32, u8) {
        (self.points, self.origin as u8)
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
            return f32::from(self.inherited) / f32::from(GUESSES);
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
