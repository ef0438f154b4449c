//! `penombre reference`.

use super::Outcome;
use super::args::ReferenceArgs;
use crate::error::{Error, Result};

/// Runs the command.
///
/// # Errors
/// As the parts it calls.
pub fn run(_args: &ReferenceArgs) -> Result<Outcome> {
    // Replaced when the passes land: this branch holds no Vulkan and no scene loader to call.
    Err(Error::Internal("reference is not part of this branch".to_owned()))
}
