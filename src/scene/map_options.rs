//! Options of a texture statement in an MTL file.

/// The channel of an image that makes a scalar (`-imfchan`).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Channel {
    /// Red.
    R,
    /// Green.
    G,
    /// Blue.
    B,
    /// Matte: alpha.
    M,
    /// Luminance.
    L,
    /// Depth, which no image file has.
    Z,
}

/// What the options of a texture statement ask for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct MapOptions {
    /// `-s`: how often the image repeats over a unit of the texture coordinates.
    pub scale: [f32; 2],
    /// `-o`: what is added to the scaled coordinates.
    pub offset: [f32; 2],
    /// `-clamp on`.
    pub clamp: bool,
    /// `-imfchan`.
    pub channel: Option<Channel>,
    /// First value of `-mm`: what is added to texels …
    pub base: f32,
    /// … and its second: what they count times before.
    pub gain: f32,
}

impl Default for MapOptions {
    fn default() -> Self {
        Self { scale: [1.0; 2], offset: [0.0; 2], clamp: false, channel: None, base: 0.0, gain: 1.0 }
    }
}
