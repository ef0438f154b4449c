//! Options of `diff`.

use crate::cli::values;
use crate::scene::ToneMapping;
use clap::Args;
use std::path::PathBuf;

/// Options of `diff`.
#[derive(Args, Debug)]
pub struct DiffArgs {
    /// Image to judge: .exr (radiance) or .png (as displayed)
    #[arg(value_name = "A", value_parser = values::image_path())]
    pub image: PathBuf,
    /// Reference of the same kind and size; its `mask` channel says which pixels count
    #[arg(value_name = "B", value_parser = values::image_path())]
    pub reference: PathBuf,
    /// Count only pixels that are half white or brighter in this picture
    #[arg(long, value_name = "FILE.png", value_parser = values::png_path())]
    pub mask: Option<PathBuf>,
    /// Picture of the signed relative error: red too bright, blue too dark; white 0.1 %, full colour 100 %
    #[arg(short = 'o', long = "output", value_name = "DIFF.png", value_parser = values::png_path())]
    pub output: Option<PathBuf>,
    /// Print the measures as JSON
    #[arg(long)]
    pub json: bool,
    /// relMSE with this constant in d²/(r² + E) [default: 0.01 × the reference's mean²]
    #[arg(long, value_name = "E", allow_negative_numbers = true, value_parser = values::positive)]
    pub epsilon_absolute: Option<f32>,
    /// Exposure of the images that FLIP compares [default: the reference's mean luminance becomes 0.18]
    #[arg(long, value_name = "STOPS", allow_negative_numbers = true, value_parser = values::stops)]
    pub exposure: Option<f32>,
    /// Tone-mapping operator of the images that FLIP compares [default: aces]
    #[arg(long, value_name = "OPERATOR", value_parser = values::tone_mapping())]
    pub tone_mapping: Option<ToneMapping>,
    /// When to fail.
    #[command(flatten)]
    pub limits: LimitArgs,
}

/// Limits of `diff`.
#[derive(Args, Clone, Copy, Debug, Default)]
#[command(next_help_heading = "Limits (exit status 1 when one is exceeded)")]
pub struct LimitArgs {
    /// Root mean square error
    #[arg(long, value_name = "MAX", allow_negative_numbers = true, value_parser = values::limit)]
    pub max_rmse: Option<f64>,
    /// Relative mean square error
    #[arg(long, value_name = "MAX", allow_negative_numbers = true, value_parser = values::limit)]
    pub max_relmse: Option<f64>,
    /// Mean FLIP error
    #[arg(long, value_name = "MAX", allow_negative_numbers = true, value_parser = values::limit)]
    pub max_flip: Option<f64>,
    /// Mean of A − B, whatever its sign
    #[arg(long, value_name = "MAX", allow_negative_numbers = true, value_parser = values::limit)]
    pub max_mean_shift: Option<f64>,
}
