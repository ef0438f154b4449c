//! What panels look like.

use egui::{Color32, Frame};

/// Distance of panels from the window's edge, points.
pub(super) const MARGIN: f32 = 8.0;

/// Dark and a little transparent: the picture matters more.
pub(super) fn frame() -> Frame {
    Frame::new().fill(Color32::from_black_alpha(200)).inner_margin(MARGIN).corner_radius(4.0)
}

/// Opaque: what is long must be read well, whatever lies under it.
pub(super) fn page() -> Frame {
    frame().fill(Color32::BLACK)
}
