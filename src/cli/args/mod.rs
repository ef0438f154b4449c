//! What was typed: one struct a subcommand, put together from groups of options that several share.

pub mod ablate;
pub mod bench;
mod compare;
mod depth;
mod diff;
pub mod reference;

use self::bench::BenchArgs;
use self::reference::ReferenceArgs;
use super::numbered::numbered;
use super::values;
use crate::error::{Error, Result};
use crate::estimate::hemisphere::Method;
use crate::image::atomic;
use crate::log::summary::Summary;
use crate::pass::UpdateMode;
use crate::refine::options::{Piece, Pieces, Priority};
use crate::scene::camera::ImageSize;
use crate::scene::up_axis::UpAxis;
use crate::scene::{Display, ToneMapping};
use crate::session::{Options, PixelCounts, Quality, Refinement, Thresholds, thread_count};
use clap::{Args, Parser, Subcommand};
use rayon::ThreadPool;
use std::path::{Path, PathBuf};
use std::time::Duration;

pub use compare::{CompareArgs, CompareLimits, Tilt};
pub use depth::DepthArgs;
pub use diff::{DiffArgs, LimitArgs};

/// Heading of the options about what is refined.
const REFINEMENT: &str = "Refinement";
/// Heading of the options about drawing.
const GPU: &str = "GPU";
/// Heading of the options about what is said and logged.
const MESSAGES: &str = "Messages";

const AFTER_HELP: &str = "\
Examples:
  penombre render scene.toml -o image.png --time 10
  penombre render model.obj -o image.exr -o image.png --aa 16 --log frames.csv
  penombre render scene.toml -o walk_####.png --camera-path walk.toml --error 0.05
  penombre compare scene.toml --out report
  penombre reference scene.toml -o ref.exr --filter point --spp 1024 --pixels 4000
  penombre diff image.exr ref.exr --max-relmse 0.001 -o errors.png
  penombre bench scene.toml
  penombre bench convergence scene.toml --reference ref.exr --plot errors.svg
  penombre bench ablate scene.toml=ref.exr --pieces radiance-grid,checks
  penombre info

Exit status:
  0 done    1 diff, compare: a limit was exceeded    2 bad usage or input
  3 no usable Vulkan device    4 device lost or out of memory    70 internal error
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
    /// Replay one refinement in several update modes and report their artefacts and cost
    Compare(CompareArgs),
    /// Path-trace a scene on the CPU, without any cache: the yardstick
    Reference(ReferenceArgs),
    /// Measure how far an image is from a reference
    Diff(DiffArgs),
    /// Measure speeds of rays, errors of the hemisphere methods, convergence
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
    /// What is refined.
    #[command(flatten)]
    pub refinement: RefinementArgs,
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
    /// Milliseconds between two frames while the camera is still
    #[arg(long, value_name = "MS", allow_negative_numbers = true, default_value = "40",
        value_parser = values::milliseconds, help_heading = GPU)]
    pub refresh: Duration,
    /// The Vulkan device.
    #[command(flatten)]
    pub device: DeviceArgs,
    /// Frame log (CSV, a row a frame); a summary goes beside it as FRAMES.json
    #[arg(long, value_name = "FRAMES.csv", value_parser = values::csv_path(), help_heading = MESSAGES)]
    pub log: Option<PathBuf>,
    /// Reference image of the same view: adds error columns to the log
    #[arg(long, value_name = "REF.exr", requires = "log", help_heading = MESSAGES)]
    pub reference: Option<PathBuf>,
    /// How much is said.
    #[command(flatten)]
    pub verbosity: VerbosityArgs,
}

/// The scene and the view of it.
#[derive(Args, Clone, Debug)]
pub struct SceneArgs {
    /// Scene file (.toml) or bare .obj
    #[arg(value_name = "SCENE")]
    pub path: PathBuf,
    /// Camera of the scene file [default: the first]
    #[arg(long, value_name = "NAME")]
    pub camera: Option<String>,
    /// Image size in pixels
    #[arg(long, value_name = "WxH", default_value_t = Options::SIZE, value_parser = values::size)]
    pub size: ImageSize,
    /// Axis that points up in a bare .obj, for the camera and the light that are added [default: y]
    #[arg(long, value_name = "AXIS", value_parser = values::up_axis())]
    pub up: Option<UpAxis>,
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
#[command(next_help_heading = "Light engine")]
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

/// Where refinement stops without `--quality`: the defaults that the help text shows.
const NORMAL: Thresholds = Quality::Normal.thresholds();

/// What is refined, and how far.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = REFINEMENT)]
pub struct RefinementArgs {
    /// How far light is refined: sets --min-pixels, --contrast, --shadow-size, an inner tolerance, and the error that ends a render
    /// without other limits; those that are given win
    #[arg(long, value_name = "PRESET", default_value = Quality::default().name(), value_parser = values::quality())]
    pub quality: Quality,
    /// Only light that arrives from the sources without a bounce
    #[arg(long)]
    pub direct_only: bool,
    /// How the directions of indirect light are chosen: evenly, so that rays add up without bias, or by what the first rays
    /// found, with a bias (to compare)
    #[arg(long, value_name = "METHOD", default_value = Refinement::default().hemisphere.name(),
        value_parser = values::hemisphere(),
        conflicts_with = "direct_only")]
    pub hemisphere: Method,
    /// Lights whose visibility is kept each by itself; where there are more, small ones near each other share a mesh, which costs
    /// less and blurs their shadows for longer
    #[arg(long = "max-light-meshes", value_name = "N", allow_negative_numbers = true, default_value_t = Refinement::default().max_light_groups,
        value_parser = clap::value_parser!(u32).range(1..))]
    pub max_light_groups: u32,
    /// Which triangle is split next: where most image error goes a ray, or at random as the paper does
    #[arg(long, value_name = "MODE", default_value = "error", value_parser = values::priority())]
    pub priority: Priority,
    /// Triangles that cover no more pixels are not split; `None` as the preset says
    #[arg(long, value_name = "PIXELS", allow_negative_numbers = true, value_parser = values::not_negative,
        help = format!("Triangles that cover no more pixels are not split [default: {}]", NORMAL.min_pixels))]
    pub min_pixels: Option<f32>,
    /// Michelson contrast that counts as a discontinuity; `None` as the preset says
    #[arg(long, value_name = "CONTRAST", allow_negative_numbers = true, value_parser = values::positive,
        help = format!("Michelson contrast that counts as a discontinuity (with --priority random) [default: {}]",
            NORMAL.contrast))]
    pub contrast: Option<f32>,
    /// Size of the smallest shadow that must not be missed, scene units; `None` as the preset says
    #[arg(long, value_name = "LENGTH", allow_negative_numbers = true, value_parser = values::positive,
        help = format!("Size of the smallest shadow that must not be missed, scene units [default: about {} pixels, near the \
            eye too]", NORMAL.shadow_pixels))]
    pub shadow_size: Option<f32>,
    /// Pieces of the engine that are taken out, to measure what they are worth (see `penombre bench ablate`)
    #[arg(long, value_name = "PIECE,PIECE", value_delimiter = ',', value_parser = values::piece(), hide = true)]
    pub without: Vec<Piece>,
}

impl RefinementArgs {
    /// The pieces that are taken out.
    #[must_use]
    pub fn without(&self) -> Pieces {
        self.without.iter().copied().collect()
    }
}

/// The Vulkan device.
#[derive(Args, Clone, Debug, Default)]
#[command(next_help_heading = GPU)]
pub struct DeviceArgs {
    /// Vulkan device, by number or part of its name (see `penombre info`) [default: the fastest kind]
    #[arg(long, value_name = "INDEX|NAME")]
    pub device: Option<String>,
}

/// How much is said.
#[derive(Args, Clone, Copy, Debug, Default)]
#[command(next_help_heading = MESSAGES)]
pub struct VerbosityArgs {
    /// Say more: device, formats, times
    #[arg(short, long, conflicts_with = "quiet")]
    pub verbose: bool,
    /// Say nothing but warnings and errors
    #[arg(short, long)]
    pub quiet: bool,
}

/// Threads, random numbers and messages of the commands that need no GPU.
#[derive(Args, Clone, Copy, Debug, Default)]
pub struct CpuArgs {
    /// Threads [default: all cores]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(1..=256))]
    pub threads: Option<u32>,
    /// Seed of all random choices
    #[arg(long, value_name = "N", allow_negative_numbers = true, default_value_t = 0)]
    pub seed: u64,
    /// How much is said.
    #[command(flatten)]
    pub verbosity: VerbosityArgs,
}

impl CpuArgs {
    /// The pool of threads asked for.
    ///
    /// # Errors
    /// [`Error::Exhausted`] if the system gives no threads.
    pub fn pool(&self) -> Result<ThreadPool> {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(thread_count(self.threads)).build();
        pool.map_err(|e| Error::Exhausted(format!("cannot start threads: {e}")))
    }
}

/// Options of `info`.
#[derive(Args, Debug)]
pub struct InfoArgs {
    /// As JSON
    #[arg(long)]
    pub json: bool,
}

impl SceneArgs {
    /// The options that determine the image, for the EXR's attributes: never threads, output paths or clocks, so that
    /// two runs that make the same image write the same bytes.
    #[must_use]
    pub fn image_options(&self, command: &str, seed: u64) -> String {
        let ImageSize { width, height } = self.size;
        let scene = self.path.file_name().unwrap_or_default().to_string_lossy();
        let camera = self.camera.as_ref().map_or_else(String::new, |name| format!(" --camera {name}"));
        let up = if self.up == Some(UpAxis::Z) { " --up z" } else { "" };
        format!("penombre {command} {scene} --size {width}x{height}{camera}{up} --seed {seed}")
    }
}

impl RenderArgs {
    /// Every file that the command writes: images (the first of a path), frame log, summary.
    fn written(&self) -> Vec<PathBuf> {
        let log = self.log.iter().flat_map(|log| [log.clone(), Summary::path_beside(log)]);
        let numbered = |path: &PathBuf| if self.camera_path.is_some() { numbered(path, 1) } else { path.clone() };
        self.output.paths.iter().map(numbered).chain(log).collect()
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
