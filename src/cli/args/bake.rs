//! Options of `bake`.

use super::super::values;
use super::shared::{CpuArgs, RefinementArgs};
use crate::bake::baker::{Plan, Sides, Triangles};
use crate::error::Result;
use crate::image::atomic;
use crate::scene::up_axis::UpAxis;
use crate::scene::{Display, ToneMapping};
use crate::session::{Budget, Options, Quality};
use clap::Args;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Options of `bake`.
#[derive(Args, Debug)]
pub struct BakeArgs {
    /// Scene file (.toml) or bare .obj, .gltf or .glb
    #[arg(value_name = "SCENE")]
    pub path: PathBuf,
    /// Axis that points up in a bare .obj, for the light that is added [default: y]
    #[arg(long, value_name = "AXIS", value_parser = values::up_axis())]
    pub up: Option<UpAxis>,
    /// What is written.
    #[command(flatten)]
    pub output: BakeOutputArgs,
    /// When to stop.
    #[command(flatten)]
    pub budget: BakeBudgetArgs,
    /// What is refined; a texel counts as a pixel.
    #[command(flatten)]
    pub refinement: RefinementArgs,
    /// Threads, seed and messages.
    #[command(flatten)]
    pub cpu: CpuArgs,
}

/// What is written.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Output")]
pub struct BakeOutputArgs {
    /// File to write: .ply (float light, colours as displayed) or .glb (glTF, unlit, with textures); may repeat
    #[arg(short = 'o', long = "output", value_name = "OUT", required = true, value_parser = values::mesh_path())]
    pub paths: Vec<PathBuf>,
    /// Whose triangles: `adapted` follow the edges of shadows, `base` are the scene's
    #[arg(long, value_name = "WHOSE", default_value = "adapted", value_parser = values::baked_triangles())]
    pub mesh: Triangles,
    /// Which sides of triangles, each as triangles of its own: `lit` are those that light reaches
    #[arg(long, value_name = "WHICH", default_value = "lit", value_parser = values::baked_sides())]
    pub sides: Sides,
    /// Side of a texel, scene units: what counts as a pixel [default: half a million cover the scene's triangles]
    #[arg(long, value_name = "LENGTH", allow_negative_numbers = true, value_parser = values::positive)]
    pub texel: Option<f32>,
    /// Write the light of each light source by itself, too, and what bounces
    #[arg(long)]
    pub per_light: bool,
    /// Light that is 1 in COLOR_0 of a .glb, W/(sr m2) [default: 99 % of the area is no brighter]
    #[arg(long, value_name = "LIGHT", allow_negative_numbers = true, value_parser = values::positive)]
    pub scale: Option<f32>,
    /// Exposure in stops of the colours in a .ply [default: the scene's, or 0]
    #[arg(long, value_name = "STOPS", allow_negative_numbers = true, value_parser = values::stops)]
    pub exposure: Option<f32>,
    /// Tone-mapping operator of the colours in a .ply [default: the scene's, or aces]
    #[arg(long, value_name = "OPERATOR", value_parser = values::tone_mapping())]
    pub tone_mapping: Option<ToneMapping>,
}

/// When to stop: at the first limit reached, or when nothing is left to improve.
#[derive(Args, Clone, Copy, Debug, Default)]
#[command(next_help_heading = "Budgets (the first reached ends the run)")]
pub struct BakeBudgetArgs {
    /// Wall-clock seconds, loading left out
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true, value_parser = values::seconds)]
    pub time: Option<Duration>,
    /// Rays
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = clap::value_parser!(u64).range(1..))]
    pub rays: Option<u64>,
    /// Estimated relative error over all texels, which has a default where no other limit is given
    #[arg(long, value_name = "RELATIVE", allow_negative_numbers = true, value_parser = values::positive,
        help = format!("Estimated relative error over all texels [default: {} where no other limit is given]",
            Quality::default().error()))]
    pub error: Option<f32>,
}

impl BakeArgs {
    /// What is baked.
    #[must_use]
    pub const fn plan(&self) -> Plan {
        let BakeOutputArgs { mesh, sides, texel, per_light, .. } = self.output;
        Plan { triangles: mesh, sides, texel, per_light }
    }

    /// The options of a picture that is refined alike.
    #[must_use]
    pub fn picture(&self) -> Options {
        Options { seed: self.cpu.seed, refinement: self.refinement.options(true), ..Options::default() }
    }

    /// The limits, with the preset's error where there are none.
    #[must_use]
    pub fn limits(&self) -> Budget {
        let BakeBudgetArgs { time, rays, error } = self.budget;
        Budget { time, frames: None, rays, error }.or_error(self.refinement.quality.error())
    }

    /// How colours are displayed: as asked, else as the scene says.
    #[must_use]
    pub fn display(&self, scene: &Display) -> Display {
        Display {
            exposure: self.output.exposure.unwrap_or(scene.exposure),
            tone_mapping: self.output.tone_mapping.unwrap_or(scene.tone_mapping),
        }
    }

    /// Checks before any work that all files can be written.
    ///
    /// # Errors
    /// [`crate::error::Error::Usage`] that lists every fault.
    pub fn check(&self) -> Result<()> {
        let paths: Vec<&Path> = self.output.paths.iter().map(PathBuf::as_path).collect();
        atomic::check_writable(&paths)
    }
}
