//! Pieces of the engine that can be taken out, to measure what each is worth (`penombre bench ablate`).

use std::fmt;

/// A piece of the engine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Piece {
    /// Hits of gather rays read the radiance grid; without it paths go on until they are absorbed.
    RadianceGrid,
    /// Indirect light that is shown leans on neighbours while rays are few.
    Filter,
    /// Coarse levels predict base vertices; without them every visible one gathers by itself.
    CoarseLevels,
    /// What was found around a vertex tells how likely it sees a light; without it that is 1/2.
    VisibilityPrior,
    /// Corners that agree about a light settle it for the midpoints of a small leaf without a ray.
    Agreement,
    /// What was inferred or hardly traced is traced where a neighbour in a new leaf contradicts it.
    Confirm,
    /// Of many lights those that together matter little are put off.
    Deferred,
    /// How likely large leaves are to hide a shadow is learnt; without that it stays the prior.
    MissRate,
    /// The same of small leaves, from pixel checks.
    CheckRate,
    /// Pixel checks.
    Checks,
    /// A leaf of one pixel gets a vertex where that pixel sees it; without it such leaves are split as others are.
    PixelSamples,
    /// Highlights are looked for between vertices.
    Highlights,
    /// Vertices that find no light while their neighbours do are taken to be enclosed.
    Enclosed,
    /// The contact test, and its probes of dark vertices, which find the ones that other geometry covers.
    Covered,
    /// A square error counts for more where it is dark.
    Darks,
    /// A square error counts for less where the tone curve is flat.
    Display,
    /// An error is expected across a hard edge of a small face that was never split.
    UnmeasuredEdge,
    /// The estimate of a leaf takes in the midpoints that finer neighbours put on its edges.
    Hanging,
    /// A new vertex takes half the points of a light that those around it took in its penumbra.
    InheritedPoints,
    /// What neither gathered nor is predicted shows the indirect light to be expected at its place; without it, none.
    IrradiancePrior,
    /// The variance of a vertex's indirect light is pooled with its neighbours'; without that it is the vertex's own.
    PooledVariance,
    /// Indirect light is smoothed for pictures that are kept.
    Smoothing,
}

impl Piece {
    /// All pieces with the names that options use.
    pub const NAMES: [(&'static str, Self); 22] = [
        ("radiance-grid", Self::RadianceGrid),
        ("filter", Self::Filter),
        ("coarse-levels", Self::CoarseLevels),
        ("visibility-prior", Self::VisibilityPrior),
        ("irradiance-prior", Self::IrradiancePrior),
        ("agreement", Self::Agreement),
        ("confirm", Self::Confirm),
        ("deferred", Self::Deferred),
        ("miss-rate", Self::MissRate),
        ("check-rate", Self::CheckRate),
        ("checks", Self::Checks),
        ("pixel-samples", Self::PixelSamples),
        ("highlights", Self::Highlights),
        ("enclosed", Self::Enclosed),
        ("covered", Self::Covered),
        ("darks", Self::Darks),
        ("display", Self::Display),
        ("unmeasured-edge", Self::UnmeasuredEdge),
        ("hanging", Self::Hanging),
        ("inherited-points", Self::InheritedPoints),
        ("pooled-variance", Self::PooledVariance),
        ("smoothing", Self::Smoothing),
    ];

    /// Its name.
    #[must_use]
    pub fn name(self) -> &'static str {
        Self::NAMES.iter().find(|(_, piece)| *piece == self).map_or("", |(name, _)| name)
    }
}

/// A set of pieces.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Pieces(u32);

impl Pieces {
    /// Whether a piece is among them.
    #[must_use]
    pub const fn has(self, piece: Piece) -> bool {
        self.0 & 1 << piece as u32 != 0
    }

    /// These and one more.
    #[must_use]
    pub const fn with(self, piece: Piece) -> Self {
        Self(self.0 | 1 << piece as u32)
    }

    /// Whether there are none.
    #[must_use]
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }
}

impl FromIterator<Piece> for Pieces {
    fn from_iter<T: IntoIterator<Item = Piece>>(pieces: T) -> Self {
        pieces.into_iter().fold(Self::default(), Self::with)
    }
}

impl fmt::Display for Pieces {
    /// Their names, with commas between, as options take them.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let has = |(name, piece)| self.has(piece).then_some(name);
        let names: Vec<&str> = Piece::NAMES.into_iter().filter_map(has).collect();
        f.write_str(&names.join(","))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_set_has_what_was_put_in() {
        for (name, piece) in Piece::NAMES {
            let one = Pieces::default().with(piece);
            assert_eq!((piece.name(), one.to_string().as_str()), (name, name));
            let among = Piece::NAMES.iter().filter(|(_, other)| one.has(*other)).count();
            assert_eq!((among, one.with(piece)), (1, one));
        }
        assert!(Pieces::default().is_empty() && Pieces::default().to_string().is_empty());
    }

    #[test]
    fn the_order_does_not_matter() {
        let set: Pieces = [Piece::Covered, Piece::Filter].into_iter().collect();
        assert_eq!(set, Pieces::default().with(Piece::Filter).with(Piece::Covered));
        assert!(set.has(Piece::Filter) && !set.has(Piece::Checks) && !set.is_empty());
        assert_eq!(set.to_string(), "filter,covered");
    }
}
