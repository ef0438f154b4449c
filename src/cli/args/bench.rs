//! Options of `bench`.

use super::ablate::AblateArgs;
use super::clock::ClockArgs;
use super::shared::{CpuArgs, DeviceArgs, RefinementArgs};
use crate::cli::values;
use crate::error::{Error, Result};
use crate::image::atomic;
use crate::scene::up_axis::UpAxis;
use clap::{Args, Subcommand};
use std::path::PathBuf;
use std::time::Duration;

/// Options of `bench`.
#[derive(Args, Debug)]
#[command(args_conflicts_with_subcommands = true)]
pub struct BenchArgs {
    /// Another measurement than that of speeds and hemispheres.
    #[command(subcommand)]
    pub study: Option<Study>,
    /// Scene file (.toml) or bare .obj, .gltf or .glb [default: scenes/cornell_box/cornell_box.toml]
    #[arg(value_name = "SCENE")]
    pub scene: Option<PathBuf>,
    /// Camera of the scene file [default: the first]
    #[arg(long, value_name = "NAME")]
    pub camera: Option<String>,
    /// Axis that points up in a bare .obj, for the camera and the light that are added [default: y]
    #[arg(long, value_name = "AXIS", value_parser = values::up_axis())]
    pub up: Option<UpAxis>,
    /// Print the figures as JSON
    #[arg(long)]
    pub json: bool,
    /// Threads, seed and messages.
    #[command(flatten)]
    pub cpu: CpuArgs,
}

/// Measurements with options of their own.
#[derive(Debug, Subcommand)]
pub enum Study {
    /// Measure the error of the light engine and of the path tracer against CPU time
    Convergence(ConvergenceArgs),
    /// Measure the error of the light engine without each of its pieces against that with all of them
    Ablate(AblateArgs),
    /// Measure what a user waits for: first pictures, errors by the wall clock, camera moves, where the time goes, memory
    Clock(ClockArgs),
}

/// Options of `bench convergence`.
#[derive(Args, Debug)]
pub struct ConvergenceArgs {
    /// Scene file (.toml) or bare .obj, .gltf or .glb
    #[arg(value_name = "SCENE")]
    pub scene: PathBuf,
    /// Camera of the scene file [default: the first]
    #[arg(long, value_name = "NAME")]
    pub camera: Option<String>,
    /// Axis that points up in a bare .obj, for the camera and the light that are added [default: y]
    #[arg(long, value_name = "AXIS", value_parser = values::up_axis())]
    pub up: Option<UpAxis>,
    /// What errors are measured against, in its size: an image of `reference --filter point`, whole or with --pixels
    #[arg(long, value_name = "REF.exr", required = true, value_parser = values::exr_path())]
    pub reference: PathBuf,
    /// CPU seconds of the engine, all threads together; the path tracer's error is followed for no longer
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true, default_value = "10", value_parser = values::seconds)]
    pub time: Duration,
    /// Show indirect light leaning on neighbours where rays are few, as `render` does [default: as it was sampled]
    #[arg(long)]
    pub filtered: bool,
    /// The path tracer simplifies as `reference --match-method` does, for a reference of that kind
    #[arg(long, conflicts_with = "direct_only")]
    pub match_method: bool,
    /// Print the figures as JSON
    #[arg(long)]
    pub json: bool,
    /// Plot of both errors over CPU time
    #[arg(long, value_name = "PLOT.svg", value_parser = values::svg_path())]
    pub plot: Option<PathBuf>,
    /// Threads, seed and messages.
    #[command(flatten)]
    pub cpu: CpuArgs,
    /// What is refined.
    #[command(flatten)]
    pub refinement: RefinementArgs,
    /// The Vulkan device.
    #[command(flatten)]
    pub device: DeviceArgs,
}

impl ConvergenceArgs {
    /// Checks before any work that the plot can be written.
    ///
    /// # Errors
    /// [`Error::Usage`] saying why not.
    pub fn check(&self) -> Result<()> {
        match &self.plot {
            Some(plot) if atomic::is_same_file(plot, &self.reference) => {
                Err(Error::Usage(format!("{}: is both the reference and the plot", plot.display())))
            }
            Some(plot) => atomic::check_writable(&[plot]),
            None => Ok(()),
        }
    }
}
