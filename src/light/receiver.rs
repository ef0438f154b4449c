//! Where light is received that a highlight reflects to the eye.

use crate::bsdf::Lobe;
use glam::Vec3;

/// A place on a surface with a highlight, as the eye sees it.
#[derive(Clone, Copy, Debug)]
pub struct Receiver {
    /// Place, scene units.
    pub x: Vec3,
    /// Unit normal.
    pub normal: Vec3,
    /// Unit direction to the eye.
    pub to_eye: Vec3,
    /// The highlight as the eye sees it.
    pub lobe: Lobe,
}
