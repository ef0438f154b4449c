//! Options of `reference`.

use super::shared::{CpuArgs, SceneArgs};
use crate::cli::values;
use crate::error::{Error, Result};
use crate::image::atomic;
use clap::{Args, ValueEnum};
use std::path::PathBuf;
use std::time::Duration;

/// Options of `reference`.
#[derive(Args, Debug)]
pub struct ReferenceArgs {
    /// The scene and the view of it.
    #[command(flatten)]
    pub scene: SceneArgs,
    /// File to write (.exr, 32-bit float, with variance)
    #[arg(short = 'o', long = "output", value_name = "REF.exr", value_parser = values::exr_path())]
    pub output: PathBuf,
    /// Only light that arrives from the sources without a bounce
    #[arg(long)]
    pub direct_only: bool,
    /// Surfaces beyond the first hit reflect diffusely (what would go into their highlights, too), as the light engine takes
    /// them: what is left between the images is the engine's error, not what the method leaves out
    #[arg(long, conflicts_with = "direct_only")]
    pub match_method: bool,
    /// Samples a pixel [default: 256, or as many as fit into --time]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(1..))]
    pub spp: Option<u32>,
    /// Wall-clock seconds after which no new pass over the image starts
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true, value_parser = values::seconds)]
    pub time: Option<Duration>,
    /// Trace only N pixels at random, the same ones whatever the seed; comparisons leave the others out [default: all]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(1..))]
    pub pixels: Option<u32>,
    /// Where in the pixel samples lie: its centre (as `render --aa 1`), or anywhere in it
    #[arg(long, value_enum, value_name = "FILTER", default_value_t = PixelFilter::Box)]
    pub filter: PixelFilter,
    /// Threads, seed and messages.
    #[command(flatten)]
    pub cpu: CpuArgs,
}

/// Where in a pixel camera rays pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum PixelFilter {
    /// The pixel's centre
    Point,
    /// Uniformly over the pixel
    Box,
}

impl ReferenceArgs {
    /// The options that determine the image, for its EXR attributes.
    #[must_use]
    pub fn image_options(&self) -> String {
        let filter = match self.filter {
            PixelFilter::Point => "point",
            PixelFilter::Box => "box",
        };
        let transport = match (self.direct_only, self.match_method) {
            (true, _) => " --direct-only",
            (_, true) => " --match-method",
            _ => "",
        };
        let pixels = self.pixels.map_or_else(String::new, |n| format!(" --pixels {n}"));
        self.scene.image_options("reference", self.cpu.seed) + &format!("{transport} --filter {filter}{pixels}")
    }

    /// Checks before any work that the image has as many pixels as asked for and that the file can be written.
    ///
    /// # Errors
    /// [`Error::Usage`] saying why not.
    pub fn check(&self) -> Result<()> {
        let all = self.scene.size.pixels();
        if let Some(pixels) = self.pixels.filter(|&n| n as usize > all) {
            return Err(Error::Usage(format!(
                "--pixels {pixels}: the image has {all}; without --pixels all are traced"
            )));
        }
        atomic::check_writable(&[&self.output])
    }

    /// Samples a pixel at most.
    #[must_use]
    pub fn max_spp(&self) -> u32 {
        const DEFAULT: u32 = 256;
        self.spp.unwrap_or(if self.time.is_some() { u32::MAX } else { DEFAULT })
    }
}
