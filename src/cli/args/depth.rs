//! How depth is kept.

use super::shared::GPU;
use crate::cli::values;
use crate::pass::{DepthFormat, DepthOrder};
use clap::Args;

/// How depth is kept.
#[derive(Args, Clone, Copy, Debug)]
#[command(next_help_heading = GPU)]
pub struct DepthArgs {
    /// Format of depth images [default: the best that the device has with a stencil]
    #[arg(long, value_name = "FORMAT", value_parser = values::depth_format())]
    pub depth_format: Option<DepthFormat>,
    /// Which end of the range of depths is near: 1 (floats are dense where distances need it) or 0
    #[arg(long, value_name = "ORDER", default_value = "reversed", value_parser = values::depth_order())]
    pub depth: DepthOrder,
}

impl DepthArgs {
    /// The options as typed, where they are not the default.
    #[must_use]
    pub fn image_options(&self) -> String {
        let format = self.depth_format.map_or_else(String::new, |f| format!(" --depth-format {}", f.name()));
        let order = if self.depth == DepthOrder::default() { "" } else { " --depth ordinary" };
        format + order
    }
}
