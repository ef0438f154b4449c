//! Shaders that were edited while they are used.

use super::{Viewer, first_lines};
use crate::error::{Error, Result};
use crate::vk::edited_shaders::EditedShaders;
use std::sync::Arc;

/// Files that hold shaders.
const SHADERS: &str = "shaders";

impl Viewer {
    /// Draws with shaders that were compiled again. What is wrong with them is said until it is mended, and all stays as it was.
    ///
    /// # Errors
    /// The device is lost, or memory runs out.
    pub fn edited(&mut self, edited: Result<EditedShaders, Vec<String>>) -> Result<()> {
        let edited = match edited {
            Ok(edited) => edited,
            Err(faults) => {
                self.faults.insert(SHADERS, first_lines(faults.iter().map(String::as_str)));
                return Ok(());
            }
        };
        let before = edited.take_over();
        let device = Arc::clone(self.session.renderer().device());
        match self.session.replace_device(device) {
            Ok(()) => {
                self.faults.remove(SHADERS);
                self.say("shaders were compiled again");
            }
            // The driver does not take them.
            Err(fault @ (Error::Internal(_) | Error::NoDevice(_))) => {
                let _ = before.take_over();
                self.faults.insert(SHADERS, fault.to_string());
            }
            Err(other) => return Err(other),
        }
        self.show_anew();
        Ok(())
    }
}
