//! What the path tracer computes.

/// How a pixel is sampled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Filter {
    /// At its centre, as a render without `--aa` does.
    Point,
    /// Uniformly over its square.
    Box,
}

/// Which light is traced.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Transport {
    /// All of it.
    Full,
    /// All of it, but surfaces beyond the first hit reflect diffusely, what would go into their highlights, too. This
    /// is what the light engine approximates, so that an image may be compared without what the method leaves out.
    Method,
    /// What arrives at the first hit from the sources without a bounce.
    Direct,
}

/// How the light of area sources is found. All have the same mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Strategy {
    /// By sampling lights and by sampling reflection, weighed by the power heuristic.
    Both,
    /// By sampling lights only.
    Lights,
    /// By sampling reflection only.
    Reflection,
}

/// What is computed.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// How a pixel is sampled.
    pub filter: Filter,
    /// Which light is traced.
    pub transport: Transport,
    /// How area lights are found; with [`Transport::Direct`] always by sampling lights.
    pub strategy: Strategy,
}
