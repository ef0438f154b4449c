//! Groups of options that several subcommands share.

use super::super::values;
use crate::error::{Error, Result};
use crate::estimate::hemisphere::Method;
use crate::refine::options::{Piece, Pieces, Priority};
use crate::scene::camera::ImageSize;
use crate::scene::up_axis::UpAxis;
use crate::session::{Options, Quality, Refinement, Thresholds, memory_budget, thread_count};
use clap::Args;
use rayon::ThreadPool;
use std::path::PathBuf;

/// Heading of the options about what is refined.
pub(super) const REFINEMENT: &str = "Refinement";
/// Heading of the options about the light engine.
pub(super) const LIGHT_ENGINE: &str = "Light engine";
/// Heading of the options about drawing.
pub(super) const GPU: &str = "GPU";
/// Heading of the options about what is said and logged.
pub(super) const MESSAGES: &str = "Messages";

/// The scene and the view of it.
#[derive(Args, Clone, Debug)]
pub struct SceneArgs {
    /// Scene file (.toml) or bare .obj, .gltf or .glb
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

/// Where light is kept.
#[derive(Args, Clone, Debug, Default)]
pub struct CacheArgs {
    /// Keep the light that is found in a directory, and begin with what an earlier run of the same scene left there: for other cameras and
    /// sizes, too, and as far as it holds for changed lights and materials
    #[arg(long, value_name = "DIR", conflicts_with = "without", help_heading = LIGHT_ENGINE)]
    pub cache_dir: Option<PathBuf>,
}

/// The Vulkan device.
#[derive(Args, Clone, Debug, Default)]
#[command(next_help_heading = GPU)]
pub struct DeviceArgs {
    /// Vulkan device, by number or part of its name (see `penombre info`) [default: the fastest kind]
    #[arg(long, value_name = "INDEX|NAME")]
    pub device: Option<String>,
}

/// Memory and disk for the light.
#[derive(Args, Clone, Debug, Default)]
#[command(next_help_heading = REFINEMENT)]
pub struct MemoryArgs {
    /// Memory that light may take, MiB: beyond, what is out of view goes to disk, and what is in view is refined less [default: half
    /// of what is free]
    #[arg(long, value_name = "MiB", allow_negative_numbers = true, value_parser = clap::value_parser!(u64).range(1..=1 << 40))]
    pub memory: Option<u64>,
}

impl MemoryArgs {
    /// Bytes that the light engine may hold.
    #[must_use]
    pub fn budget(&self) -> Option<u64> {
        memory_budget(self.memory.map(|mib| mib << 20))
    }
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
