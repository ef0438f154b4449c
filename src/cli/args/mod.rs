//! What was typed: one struct a subcommand, put together from groups of options that several share.

pub mod ablate;
pub mod bake;
pub mod bench;
pub mod clock;
mod compare;
mod depth;
mod diff;
mod probe;
pub mod reference;
mod shared;
mod view;

use self::bake::BakeArgs;
use self::bench::BenchArgs;
use self::reference::ReferenceArgs;
use self::shared::{GPU, LIGHT_ENGINE, MESSAGES, REFINEMENT};
use super::numbered::numbered;
use super::values;
use crate::error::{Error, Result};
use crate::estimate::hemisphere::Method;
use crate::image::atomic;
use crate::log::summary::Summary;
use crate::pass::UpdateMode;
use crate::scene::{Display, ToneMapping};
use crate::session::{PixelCounts, Quality};
use clap::{Args, Parser, Subcommand};
use std::path::{Path, PathBuf};
use std::time::Duration;

pub use compare::{CompareArgs, CompareLimits, Tilt};
pub use depth::DepthArgs;
pub use diff::{DiffArgs, LimitArgs};
pub use probe::ProbeArgs;
pub use shared::{CacheArgs, CpuArgs, DeviceArgs, MemoryArgs, RefinementArgs, SceneArgs, VerbosityArgs};
pub use view::ViewArgs;

const AFTER_HELP: &str = "\
Examples:
  penombre render scene.toml -o image.png --time 10
  penombre render model.obj -o image.exr -o image.png --aa 16 --log frames.csv
  penombre render scene.toml -o walk_####.png --camera-path walk.toml --error 0.05
  penombre render scene.toml -o image.png --cache-dir cache
  penombre view scene.toml
  penombre probe scene.toml 120 80 --size 320x240 --rays 1000000
  penombre compare scene.toml --out report
  penombre reference scene.toml -o ref.exr --filter point --spp 1024 --pixels 4000
  penombre bake scene.toml -o lit.glb -o lit.ply
  penombre diff image.exr ref.exr --max-relmse 0.001 -o errors.png
  penombre bench scene.toml
  penombre bench convergence scene.toml --reference ref.exr --plot errors.svg
  penombre bench clock scene.toml=ref.exr --plot clock.svg
  penombre bench ablate scene.toml=ref.exr --pieces radiance-grid,checks
  penombre info

Exit status:
  0 done    1 diff, compare: a limit was exceeded    2 bad usage or input
  3 no usable Vulkan device, no display    4 device lost or out of memory    70 internal error
  130 interrupted (the outputs are written all the same)";

/// Progressive global illumination: exact geometry from the first frame, lighting that converges
#[derive(Debug, Parser)]
#[command(name = "penombre", version, after_help = AFTER_HELP, subcommand_required = true, arg_required_else_help = true)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// The subcommands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Render a scene to files, progressively, until a budget is spent
    Render(RenderArgs),
    /// Walk through a scene in a window while its light converges; play scripts
    View(ViewArgs),
    /// Explain a pixel: its triangle, vertices, and what each light adds, as JSON
    Probe(ProbeArgs),
    /// Replay one refinement in several update modes and report their artefacts and cost
    Compare(CompareArgs),
    /// Path-trace a scene on the CPU, without any cache: the yardstick
    Reference(ReferenceArgs),
    /// Write the lit mesh, with light at its vertices, for all of a scene: no device needed
    Bake(BakeArgs),
    /// Measure how far an image is from a reference
    Diff(DiffArgs),
    /// Measure speeds of rays, errors of the hemisphere methods, convergence, the user's clock
    Bench(BenchArgs),
    /// List the Vulkan devices, what each lacks, and the formats that would be used
    Info(InfoArgs),
}

/// Options of `render`.
#[derive(Args, Debug)]
pub struct RenderArgs {
    /// The scene and the view of it.
    #[command(flatten)]
    pub scene: SceneArgs,
    /// Fly the camera along a path and switch lights on the way, writing a numbered picture for each moment (#### in OUT
    /// stands for the number); --frames is their number [default: 24 a second], --time and --rays are shared out among them,
    /// --error holds for each
    #[arg(long, value_name = "PATH.toml", conflicts_with = "reference")]
    pub camera_path: Option<PathBuf>,
    /// What is written.
    #[command(flatten)]
    pub output: OutputArgs,
    /// When to stop.
    #[command(flatten)]
    pub budget: BudgetArgs,
    /// The light engine.
    #[command(flatten)]
    pub engine: EngineArgs,
    /// Where light is kept.
    #[command(flatten)]
    pub cache: CacheArgs,
    /// What is refined.
    #[command(flatten)]
    pub refinement: RefinementArgs,
    /// Memory and disk.
    #[command(flatten)]
    pub memory: MemoryArgs,
    /// Show indirect light as it was sampled, without leaning on neighbours where rays are few
    #[arg(long, help_heading = REFINEMENT)]
    pub no_filter: bool,
    /// How changed lighting is redrawn: `id` was measured to be exact and as cheap as any (see `penombre compare`)
    #[arg(long, value_name = "MODE", default_value = UpdateMode::default().name(), value_parser = values::update_mode(), help_heading = GPU)]
    pub update: UpdateMode,
    /// How depth is kept.
    #[command(flatten)]
    pub depth: DepthArgs,
    /// How the pixels of triangles are counted, which steers refinement
    #[arg(long, value_name = "HOW", value_enum, default_value_t = PixelCounts::default(), help_heading = GPU)]
    pub pixel_counts: PixelCounts,
    /// Milliseconds between two frames while the camera is still [default: 40 on a graphics card; on a CPU, frames that take a
    /// tenth of the time]
    #[arg(long, value_name = "MS", allow_negative_numbers = true, value_parser = values::milliseconds, help_heading = GPU)]
    pub refresh: Option<Duration>,
    /// The Vulkan device.
    #[command(flatten)]
    pub device: DeviceArgs,
    /// Frame log (CSV, a row a frame); a summary goes beside it as FRAMES.json
    #[arg(long, value_name = "FRAMES.csv", value_parser = values::csv_path(), help_heading = MESSAGES)]
    pub log: Option<PathBuf>,
    /// Frames in which the device is lost on purpose, to test what comes then
    #[arg(long, value_name = "FRAME", hide = true)]
    pub lose_device_at: Vec<u64>,
    /// What threads and GPU do when, to look at on <https://ui.perfetto.dev>
    #[arg(long, value_name = "TRACE.json", value_parser = values::json_path(), help_heading = MESSAGES)]
    pub trace: Option<PathBuf>,
    /// Reference image of the same view: adds error columns to the log
    #[arg(long, value_name = "REF.exr", requires = "log", help_heading = MESSAGES)]
    pub reference: Option<PathBuf>,
    /// How much is said.
    #[command(flatten)]
    pub verbosity: VerbosityArgs,
}

/// What is written, and how it is displayed.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Output")]
pub struct OutputArgs {
    /// File to write: .exr (linear, with layers) or .png (as displayed); may repeat
    #[arg(short = 'o', long = "output", value_name = "OUT", required = true, value_parser = values::image_path())]
    pub paths: Vec<PathBuf>,
    /// Redraw the written image N times with sub-pixel offsets and average
    #[arg(long, value_name = "N", allow_negative_numbers = true, default_value_t = 1,
        value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub aa: u32,
    /// Exposure in stops [default: the scene's, or 0]
    #[arg(long, value_name = "STOPS", allow_negative_numbers = true, value_parser = values::stops)]
    pub exposure: Option<f32>,
    /// Tone-mapping operator [default: the scene's, or aces]
    #[arg(long, value_name = "OPERATOR", value_parser = values::tone_mapping())]
    pub tone_mapping: Option<ToneMapping>,
}

impl OutputArgs {
    /// How the image is displayed: as asked, else as the scene says.
    #[must_use]
    pub fn display(&self, scene: &Display) -> Display {
        Display {
            exposure: self.exposure.unwrap_or(scene.exposure),
            tone_mapping: self.tone_mapping.unwrap_or(scene.tone_mapping),
        }
    }
}

/// When to stop: at the first limit reached, or when nothing is left to improve.
#[derive(Args, Clone, Copy, Debug, Default)]
#[command(next_help_heading = "Budgets (the first reached ends the run)")]
pub struct BudgetArgs {
    /// Wall-clock seconds from the first frame with light: loading and building the ray hierarchy come before
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true, value_parser = values::seconds)]
    pub time: Option<Duration>,
    /// Frames; with --camera-path the pictures
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = clap::value_parser!(u64).range(1..))]
    pub frames: Option<u64>,
    /// Rays
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = clap::value_parser!(u64).range(1..))]
    pub rays: Option<u64>,
    /// Estimated relative error of the image, which has a default where no other limit is given
    #[arg(long, value_name = "RELATIVE", allow_negative_numbers = true, value_parser = values::positive,
        help = format!("Estimated relative error of the image [default: {} where no other limit is given]",
            Quality::default().error()))]
    pub error: Option<f32>,
}

/// The light engine.
#[derive(Args, Clone, Copy, Debug)]
#[command(next_help_heading = LIGHT_ENGINE)]
pub struct EngineArgs {
    /// Threads that trace rays [default: all cores]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(1..=256))]
    pub threads: Option<u32>,
    /// Seed of all random choices
    #[arg(long, value_name = "N", allow_negative_numbers = true, default_value_t = 0)]
    pub seed: u64,
    /// Fix the work of a frame by rays, not by clock: the same image for the same seed, whatever the thread count
    #[arg(long, conflicts_with = "time")]
    pub deterministic: bool,
}

/// Options of `info`.
#[derive(Args, Debug)]
pub struct InfoArgs {
    /// As JSON
    #[arg(long)]
    pub json: bool,
}

impl RenderArgs {
    /// Every file that the command writes: images (the first of a path), frame log, summary, trace.
    fn written(&self) -> Vec<PathBuf> {
        let log = self.log.iter().flat_map(|log| [log.clone(), Summary::path_beside(log)]);
        let numbered = |path: &PathBuf| if self.camera_path.is_some() { numbered(path, 1) } else { path.clone() };
        self.output.paths.iter().map(numbered).chain(log).chain(self.trace.clone()).collect()
    }

    /// Checks before any work that all files can be written and that none would replace the reference.
    ///
    /// # Errors
    /// [`Error::Usage`] that lists every fault.
    pub fn check_outputs(&self) -> Result<()> {
        let written = self.written();
        let paths: Vec<&Path> = written.iter().map(PathBuf::as_path).collect();
        atomic::check_writable(&paths)?;
        match &self.reference {
            Some(reference) if paths.iter().any(|p| atomic::is_same_file(p, reference)) => {
                Err(Error::Usage(format!("{}: is both the reference and an output", reference.display())))
            }
            _ => Ok(()),
        }
    }

    /// The options that determine the image, for its EXR attributes.
    #[must_use]
    pub fn image_options(&self) -> String {
        let mut text = self.scene.image_options("render", self.engine.seed);
        text += &format!(" --update {} --aa {}", self.update.name(), self.output.aa);
        text += &self.depth.image_options();
        match self.refinement {
            RefinementArgs { direct_only: true, .. } => text += " --direct-only",
            RefinementArgs { hemisphere: Method::Stratified, .. } => {}
            RefinementArgs { hemisphere, .. } => text += &format!(" --hemisphere {}", hemisphere.name()),
        }
        if self.refinement.quality != Quality::default() {
            text += &format!(" --quality {}", self.refinement.quality.name());
        }
        text += if self.no_filter { " --no-filter" } else { "" };
        if !self.refinement.without.is_empty() {
            text += &format!(" --without {}", self.refinement.without());
        }
        let BudgetArgs { frames, rays, error, .. } = self.budget;
        let budgets = [
            ("frames", frames.map(|n| n.to_string())),
            ("rays", rays.map(|n| n.to_string())),
            ("error", error.map(|e| e.to_string())),
        ];
        for (name, value) in budgets {
            text += &value.map_or_else(String::new, |v| format!(" --{name} {v}"));
        }
        if let Some(path) = &self.camera_path {
            let path = path.file_name().unwrap_or_default().to_string_lossy();
            text += &format!(" --camera-path {path}");
        }
        text
    }
}
