//! Options of `probe`.

use super::shared::REFINEMENT;
use super::{BudgetArgs, DeviceArgs, EngineArgs, RefinementArgs, SceneArgs, VerbosityArgs};
use clap::Args;

/// Options of `probe`.
#[derive(Args, Debug)]
pub struct ProbeArgs {
    /// The scene and the view of it.
    #[command(flatten)]
    pub scene: SceneArgs,
    /// Column of the pixel, from 0 at the left
    #[arg(value_name = "X")]
    pub x: u32,
    /// Row of the pixel, from 0 at the top
    #[arg(value_name = "Y")]
    pub y: u32,
    /// When to stop.
    #[command(flatten)]
    pub budget: BudgetArgs,
    /// The light engine.
    #[command(flatten)]
    pub engine: EngineArgs,
    /// What is refined.
    #[command(flatten)]
    pub refinement: RefinementArgs,
    /// Show indirect light as it was sampled, without leaning on neighbours where rays are few
    #[arg(long, help_heading = REFINEMENT)]
    pub no_filter: bool,
    /// The Vulkan device.
    #[command(flatten)]
    pub device: DeviceArgs,
    /// How much is said.
    #[command(flatten)]
    pub verbosity: VerbosityArgs,
}
