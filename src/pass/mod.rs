//! The passes of a frame: visibility, colour, luminance, combine.
