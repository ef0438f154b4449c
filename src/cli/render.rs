//! `penombre render`.

use super::Outcome;
use super::args::RenderArgs;
use crate::error::{Error, Result};

/// Runs the command.
///
/// # Errors
/// As the parts it calls.
pub fn run(_args: &RenderArgs) -> Result<Outcome> {
    // Replaced when the passes land: this branch holds no Vulkan and no scene loader to call.
    Err(Error::Internal("render is not part of this branch".to_owned()))
}
