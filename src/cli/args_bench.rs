//! Options of `bench`.

use super::args::CpuArgs;
use clap::Args;
use std::path::PathBuf;

/// Options of `bench`.
#[derive(Args, Debug)]
pub struct BenchArgs {
    /// Scene file (.toml) or bare .obj [default: scenes/cornell_box/cornell_box.toml]
    #[arg(value_name = "SCENE")]
    pub scene: Option<PathBuf>,
    /// Camera of the scene file [default: the first]
    #[arg(long, value_name = "NAME")]
    pub camera: Option<String>,
    /// Print the figures as JSON
    #[arg(long)]
    pub json: bool,
    /// Threads, seed and messages.
    #[command(flatten)]
    pub cpu: CpuArgs,
}
