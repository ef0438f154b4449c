//! `penombre info`.

use super::Outcome;
use super::args::InfoArgs;
use crate::error::{Error, Result};

/// Runs the command.
///
/// # Errors
/// As the parts it calls.
pub fn run(_args: &InfoArgs) -> Result<Outcome> {
    // Replaced when the passes land: this branch holds no Vulkan and no scene loader to call.
    Err(Error::Internal("info is not part of this branch".to_owned()))
}
