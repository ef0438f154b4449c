//! Options of `compare`.

use super::shared::{DeviceArgs, GPU, SceneArgs, VerbosityArgs};
use crate::cli::values;
use crate::compare::replay::MAX_UPDATES;
use crate::pass::{DepthFormat, DepthOrder, UpdateMode};
use crate::scene::camera::ImageSize;
use crate::scene::up_axis::UpAxis;
use clap::{Args, ValueEnum};
use std::path::PathBuf;

/// Options of `compare`.
#[derive(Args, Debug)]
pub struct CompareArgs {
    /// Scene file (.toml) or bare .obj, .gltf or .glb
    #[arg(value_name = "SCENE")]
    pub scene: PathBuf,
    /// Folder that the report goes into; made if it is not there
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Camera of the scene file, which the tilts start from [default: the first]
    #[arg(long, value_name = "NAME")]
    pub camera: Option<String>,
    /// Axis that points up in a bare .obj, for the camera and the light that are added [default: y]
    #[arg(long, value_name = "AXIS", value_parser = values::up_axis())]
    pub up: Option<UpAxis>,
    /// Image size in pixels
    #[arg(long, value_name = "WxH", default_value = "512x384", value_parser = values::size)]
    pub size: ImageSize,
    /// What is compared.
    #[command(flatten)]
    pub what: WhatArgs,
    /// What is recorded.
    #[command(flatten)]
    pub recording: RecordingArgs,
    /// When to fail.
    #[command(flatten)]
    pub limits: CompareLimits,
    /// The Vulkan device.
    #[command(flatten)]
    pub device: DeviceArgs,
    /// How much is said.
    #[command(flatten)]
    pub verbosity: VerbosityArgs,
}

impl CompareArgs {
    /// The scene as other commands take it.
    #[must_use]
    pub fn scene(&self) -> SceneArgs {
        SceneArgs { path: self.scene.clone(), camera: self.camera.clone(), size: self.size, up: self.up }
    }
}

/// What is compared.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = GPU)]
pub struct WhatArgs {
    /// Update modes, separated by commas [default: all that the device can do]
    #[arg(long, value_name = "MODES", value_delimiter = ',', value_parser = values::update_mode())]
    pub modes: Vec<UpdateMode>,
    /// Depth formats, separated by commas [default: all that the device has]
    #[arg(long, value_name = "FORMATS", value_delimiter = ',', value_parser = values::depth_format())]
    pub depth_formats: Vec<DepthFormat>,
    /// Which end of the range of depths is near: 1, 0, or both one after the other
    #[arg(long, value_name = "ORDERS", value_delimiter = ',', default_value = "reversed", value_parser = values::depth_order())]
    pub depth: Vec<DepthOrder>,
    /// Cameras, separated by commas
    #[arg(long, value_name = "TILTS", value_delimiter = ',', default_value = "frontal,oblique,grazing")]
    pub tilts: Vec<Tilt>,
    /// Near plane, scene units [default: half as far as what is nearest to each camera]
    #[arg(long, value_name = "LENGTH", allow_negative_numbers = true, value_parser = values::positive)]
    pub near: Option<f32>,
    /// Numbers of patches whose cost is measured, separated by commas
    #[arg(long, value_name = "NUMBERS", value_delimiter = ',', default_value = "10,100,1000,10000",
        value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub patches: Vec<u32>,
    /// Interleaved runs that each cost is the median of; 0 measures none
    #[arg(long, value_name = "N", allow_negative_numbers = true, default_value_t = 21,
        value_parser = clap::value_parser!(u32).range(0..=1000))]
    pub runs: u32,
}

/// How the camera looks at the surface that fills most of the scene camera's image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Tilt {
    /// 20° from its normal
    Frontal,
    /// 55° from its normal
    Oblique,
    /// 80° from its normal
    Grazing,
}

/// What is recorded.
#[derive(Args, Clone, Copy, Debug)]
#[command(next_help_heading = "Recording")]
pub struct RecordingArgs {
    /// Updates of the refinement, each drawn as a frame
    #[arg(long, value_name = "N", allow_negative_numbers = true, default_value_t = 16,
        value_parser = clap::value_parser!(u32).range(1..=MAX_UPDATES as i64))]
    pub updates: u32,
    /// Rays of an update
    #[arg(long, value_name = "N", allow_negative_numbers = true, default_value_t = 20_000, value_parser = clap::value_parser!(u64).range(1..))]
    pub rays: u64,
    /// Updates between two comparisons with a full redraw
    #[arg(long, value_name = "K", allow_negative_numbers = true, default_value_t = 1,
        value_parser = clap::value_parser!(u32).range(1..=MAX_UPDATES as i64))]
    pub every: u32,
    /// Only light that arrives from the sources without a bounce
    #[arg(long)]
    pub direct_only: bool,
    /// Threads that trace rays [default: all cores]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(1..=256))]
    pub threads: Option<u32>,
    /// Seed of all random choices
    #[arg(long, value_name = "N", allow_negative_numbers = true, default_value_t = 0)]
    pub seed: u64,
}

/// Limits of `compare`, for every mode, depth and tilt that is compared.
#[derive(Args, Clone, Copy, Debug, Default)]
#[command(next_help_heading = "Limits (exit status 1 when one is exceeded by any of the modes)")]
pub struct CompareLimits {
    /// Missed pixels, a share of those to update
    #[arg(long, value_name = "MAX", allow_negative_numbers = true, value_parser = values::limit)]
    pub max_missed: Option<f64>,
    /// Pixels written with another face than belongs there, likewise
    #[arg(long, value_name = "MAX", allow_negative_numbers = true, value_parser = values::limit)]
    pub max_foreign: Option<f64>,
    /// Mean error of the last picture against the mean of a full redraw
    #[arg(long, value_name = "MAX", allow_negative_numbers = true, value_parser = values::limit)]
    pub max_error: Option<f64>,
    /// Mean FLIP error of the last picture
    #[arg(long, value_name = "MAX", allow_negative_numbers = true, value_parser = values::limit)]
    pub max_flip: Option<f64>,
}
