//! Options of `bench clock`.

use super::shared::{CpuArgs, DeviceArgs};
use crate::cli::values::{self, ClockedScene};
use crate::error::{Error, Result};
use crate::image::atomic;
use crate::scene::camera::ImageSize;
use clap::Args;
use std::path::PathBuf;
use std::time::Duration;

/// Image size of what is measured without a reference.
const SIZE: ImageSize = ImageSize { width: 512, height: 384 };

/// Options of `bench clock`.
#[derive(Args, Debug)]
pub struct ClockArgs {
    /// Scenes (.toml, or bare .obj, .gltf, .glb); `=REF.exr` behind one is what its errors are measured against, in its size, as in
    /// `scene.toml=ref.exr`: an image of `reference --filter point`, whole or with --pixels; `@NAME` behind that names a camera
    /// of the scene [default: the first]
    #[arg(value_name = "SCENE[=REF.exr][@CAMERA]", required = true, value_parser = values::clocked_scene)]
    pub scenes: Vec<ClockedScene>,
    /// Runs of everything, of seeds that rise from --seed
    #[arg(long, value_name = "N", allow_negative_numbers = true, default_value_t = 5,
        value_parser = clap::value_parser!(u64).range(1..=1000))]
    pub runs: u64,
    /// What `render --time` is given, a run each, where there is a reference
    #[arg(long, value_name = "SECONDS,SECONDS", allow_negative_numbers = true, value_delimiter = ',',
        default_value = "0.1,0.25,0.5,1,2,4", value_parser = values::seconds)]
    pub times: Vec<Duration>,
    /// relMSE to which times are given
    #[arg(long, value_name = "RELMSE,RELMSE", allow_negative_numbers = true, value_delimiter = ',', default_value = "2e-2,5e-3,2e-3",
        value_parser = values::positive_precisely)]
    pub targets: Vec<f64>,
    /// Rays of the run that tells where the time goes; a walk has as many
    #[arg(long, value_name = "N", allow_negative_numbers = true, default_value_t = 2_000_000,
        value_parser = clap::value_parser!(u64).range(1..))]
    pub rays: u64,
    /// Image size of that run and of the walk
    #[arg(long, value_name = "WxH", default_value_t = SIZE, value_parser = values::size)]
    pub size: ImageSize,
    /// Walk along a camera path, as `render` does, with a single scene [default: a small round about the camera]
    #[arg(long, value_name = "PATH.toml")]
    pub camera_path: Option<PathBuf>,
    /// Pictures of the walk
    #[arg(long, value_name = "N", allow_negative_numbers = true, default_value_t = 60,
        value_parser = clap::value_parser!(u32).range(2..=100_000))]
    pub pictures: u32,
    /// Print the figures as JSON
    #[arg(long)]
    pub json: bool,
    /// Plot of the errors over wall seconds
    #[arg(long, value_name = "PLOT.svg", value_parser = values::svg_path())]
    pub plot: Option<PathBuf>,
    /// Threads, the first seed and messages.
    #[command(flatten)]
    pub cpu: CpuArgs,
    /// The Vulkan device.
    #[command(flatten)]
    pub device: DeviceArgs,
}

impl ClockArgs {
    /// Checks before any work that the options go together, and that the plot can be written.
    ///
    /// # Errors
    /// [`Error::Usage`] saying why not.
    pub fn check(&self) -> Result<()> {
        if self.camera_path.is_some() && self.scenes.len() > 1 {
            return Err(Error::Usage("--camera-path is of one scene: measure the others by themselves".to_owned()));
        }
        let Some(plot) = &self.plot else { return Ok(()) };
        let references = self.scenes.iter().filter_map(|scene| scene.reference.as_deref());
        if references.clone().count() == 0 {
            return Err(Error::Usage("--plot: there are no errors to draw without a SCENE=REF.exr".to_owned()));
        }
        if references.clone().any(|reference| atomic::is_same_file(plot, reference)) {
            return Err(Error::Usage(format!("{}: is both the reference and the plot", plot.display())));
        }
        atomic::check_writable(&[plot])
    }

    /// What `render --time` is given, rising, seconds.
    #[must_use]
    pub fn times(&self) -> Vec<Duration> {
        let mut times = self.times.clone();
        times.sort_unstable();
        times.dedup();
        times
    }

    /// The seed of a run, from 0.
    #[must_use]
    pub const fn seed(&self, run: u64) -> u64 {
        self.cpu.seed.wrapping_add(run)
    }
}
