//! What all update modes are made of, and what their draws are planned from.

use crate::pass::colouring::Projector;
use crate::pass::mesh::{Batch, LuminanceMesh};
use crate::pass::plan::{Plan, Visible};
use crate::scene::camera::ImageSize;
use crate::vk::DeviceReport;

/// What all modes are made of.
pub struct Shape {
    /// The name that options and reports use.
    pub name: &'static str,
    /// Whether it needs a stencil.
    pub stencil: bool,
    /// Whether it tests against the depth that was drawn before.
    pub reads_depth: bool,
    /// Whether the device has what it needs; else the feature's name.
    pub lacks: fn(&DeviceReport) -> Option<&'static str>,
    /// The draws of a batch.
    pub draw: fn(&mut Plan, &Context<'_>, &Batch),
}

/// A mode that any device has the features for.
pub const fn lacks_nothing(_: &DeviceReport) -> Option<&'static str> {
    None
}

/// What the draws of a batch are planned from.
pub struct Context<'a> {
    pub mesh: &'a LuminanceMesh,
    pub visible: &'a Visible<'a>,
    pub projector: &'a Projector,
    pub size: ImageSize,
}
