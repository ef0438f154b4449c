//! Update modes compared: one refinement replayed in each of them, what they leave behind, and what they cost.
//!
//! [`replay`] runs the modes, [`artefacts`] counts, [`cost`] measures; [`report`] holds the figures, [`page`] and the files
//! beside it show them.

pub mod artefacts;
pub mod cost;
pub mod names;
pub mod page;
pub mod pictures;
mod plot;
pub mod replay;
pub mod report;

use crate::pass::{DepthFormat, DepthOrder};
use crate::refine::update::Update;
use crate::scene::camera::{Camera, View};

/// A refinement as the GPU is told of it, from one camera.
#[derive(Clone, Debug)]
pub struct Recording {
    /// Name of the tilt.
    pub tilt: &'static str,
    /// Angle between the view and the normal of the surface that fills most of the scene camera's image, degrees.
    pub degrees: f32,
    /// The camera.
    pub camera: Camera,
    /// Its view.
    pub view: View,
    /// All visible triangles first, then what changed, an update a frame.
    pub updates: Vec<Update>,
}

/// Depth as it is compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DepthChoice {
    /// The format.
    pub format: DepthFormat,
    /// The order.
    pub order: DepthOrder,
}

impl DepthChoice {
    /// A name as in `d24s8` or `d24s8-ordinary`.
    #[must_use]
    pub fn name(&self) -> String {
        match self.order {
            DepthOrder::Reversed => self.format.name().to_owned(),
            DepthOrder::Ordinary => format!("{}-ordinary", self.format.name()),
        }
    }
}
