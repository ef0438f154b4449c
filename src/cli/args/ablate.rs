//! Options of `bench ablate`.

use super::shared::{CpuArgs, DeviceArgs, RefinementArgs};
use crate::cli::values::{self, AblatedScene};
use crate::refine::options::Piece;
use clap::Args;

/// Options of `bench ablate`.
#[derive(Args, Debug)]
pub struct AblateArgs {
    /// Scenes (.toml, or bare .obj, .gltf, .glb), each with what errors are measured against, in its size, as in `scene.toml=ref.exr`: an image
    /// of `reference --filter point`, whole or with --pixels; `@NAME` behind it names a camera of the scene [default: the first]
    #[arg(value_name = "SCENE=REF.exr[@CAMERA]", required = true, value_parser = values::ablated_scene)]
    pub scenes: Vec<AblatedScene>,
    /// Pieces of the engine that are taken out one by one [default: all]
    #[arg(long, value_name = "PIECE,PIECE", value_delimiter = ',', value_parser = values::piece())]
    pub pieces: Vec<Piece>,
    /// Runs with and without each piece, of seeds that rise from --seed
    #[arg(long, value_name = "N", allow_negative_numbers = true, default_value_t = 3,
        value_parser = clap::value_parser!(u64).range(1..=1000))]
    pub seeds: u64,
    /// Rays after which errors are measured
    #[arg(long, value_name = "N,N", allow_negative_numbers = true, value_delimiter = ',', default_value = "1000000",
        value_parser = clap::value_parser!(u64).range(1..))]
    pub rays: Vec<u64>,
    /// Share of the pixels, those of the greatest error, that the trimmed error leaves out
    #[arg(long, value_name = "SHARE", allow_negative_numbers = true, default_value_t = 0.01, value_parser = values::share)]
    pub trim: f64,
    /// Show indirect light leaning on neighbours where rays are few, as `render` does [default: as it was sampled]
    #[arg(long)]
    pub filtered: bool,
    /// Print the figures as JSON
    #[arg(long)]
    pub json: bool,
    /// Threads, the first seed and messages.
    #[command(flatten)]
    pub cpu: CpuArgs,
    /// What is refined.
    #[command(flatten)]
    pub refinement: RefinementArgs,
    /// The Vulkan device.
    #[command(flatten)]
    pub device: DeviceArgs,
}

impl AblateArgs {
    /// The pieces that are taken out one by one, each once.
    #[must_use]
    pub fn pieces(&self) -> Vec<Piece> {
        let is_asked = |piece: &Piece| self.pieces.is_empty() || self.pieces.contains(piece);
        Piece::NAMES.into_iter().map(|(_, piece)| piece).filter(is_asked).collect()
    }

    /// The numbers of rays after which errors are measured, rising.
    #[must_use]
    pub fn rays(&self) -> Vec<u64> {
        let mut rays = self.rays.clone();
        rays.sort_unstable();
        rays.dedup();
        rays
    }
}
