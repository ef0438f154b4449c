//! Options of `view`.

use super::super::values;
use super::shared::{GPU, MESSAGES};
use super::{CacheArgs, CpuArgs, DeviceArgs, MemoryArgs, RefinementArgs, SceneArgs};
use crate::app;
use crate::pass::UpdateMode;
use crate::scene::ToneMapping;
use crate::session::Batches;
use crate::vk::Vsync;
use clap::Args;
use std::path::PathBuf;

/// Heading of the options about scripts.
const SCRIPT: &str = "Script";

/// Options of `view`.
#[derive(Args, Debug)]
#[command(after_help = format!("Commands, with keys by their place on a US keyboard and what the mouse does [in brackets]:\n{}",
    app::help()))]
pub struct ViewArgs {
    /// The scene and the view of it; --size is that of the window at first.
    #[command(flatten)]
    pub scene: SceneArgs,
    /// Exposure in stops [default: the scene's, or 0]
    #[arg(long, value_name = "STOPS", allow_negative_numbers = true, value_parser = values::stops)]
    pub exposure: Option<f32>,
    /// Tone-mapping operator [default: the scene's, or aces]
    #[arg(long, value_name = "OPERATOR", value_parser = values::tone_mapping())]
    pub tone_mapping: Option<ToneMapping>,
    /// Whether pictures wait for the display's refresh; adaptive: those that are late do not
    #[arg(long, value_name = "WHEN", default_value = "on", value_parser = values::vsync())]
    pub vsync: Vsync,
    /// Commands with their times, a line each: SECONDS COMMAND ARGUMENTS, # begins a comment
    #[arg(long, value_name = "FILE", help_heading = SCRIPT)]
    pub script: Option<PathBuf>,
    /// Play the script without a window, in frames of fixed work: the same pictures for the same seed
    #[arg(long, requires = "script", help_heading = SCRIPT)]
    pub headless: bool,
    /// Frames a second of the script's time, without a window
    #[arg(long, value_name = "N", allow_negative_numbers = true, default_value_t = 24.0, requires = "headless",
        value_parser = values::positive_precisely, help_heading = SCRIPT)]
    pub fps: f64,
    /// Rays of a frame, without a window
    #[arg(long, value_name = "N", allow_negative_numbers = true, default_value_t = Batches::A_FRAME.rays, requires = "headless",
        value_parser = clap::value_parser!(u64).range(1..), help_heading = SCRIPT)]
    pub rays: u64,
    /// Write every frame, numbered (#### stands for the number): .png or .exr; without a window
    #[arg(short = 'o', long = "output", value_name = "OUT", requires = "headless", value_parser = values::image_path(),
        help_heading = SCRIPT)]
    pub output: Option<PathBuf>,
    /// Frame log (CSV, a row a frame); a summary goes beside it as FRAMES.json
    #[arg(long, value_name = "FRAMES.csv", value_parser = values::csv_path(), help_heading = MESSAGES)]
    pub log: Option<PathBuf>,
    /// Frames in which the device is lost on purpose, to test what comes then
    #[arg(long, value_name = "FRAME", hide = true)]
    pub lose_device_at: Vec<u64>,
    /// What threads and GPU do when, to look at on <https://ui.perfetto.dev>
    #[arg(long, value_name = "TRACE.json", value_parser = values::json_path(), help_heading = MESSAGES)]
    pub trace: Option<PathBuf>,
    /// Threads, random numbers and messages.
    #[command(flatten)]
    pub cpu: CpuArgs,
    /// Where light is kept.
    #[command(flatten)]
    pub cache: CacheArgs,
    /// What is refined.
    #[command(flatten)]
    pub refinement: RefinementArgs,
    /// Memory and disk.
    #[command(flatten)]
    pub memory: MemoryArgs,
    /// How changed lighting is redrawn (see `penombre compare`)
    #[arg(long, value_name = "MODE", default_value = UpdateMode::default().name(), value_parser = values::update_mode(), help_heading = GPU)]
    pub update: UpdateMode,
    /// The Vulkan device.
    #[command(flatten)]
    pub device: DeviceArgs,
}
