//! What is done when the device is lost: all that lives on it is made anew, and the same is shown again.

use super::screen::Screen;
use super::viewer::Viewer;
use crate::error::{Error, Result};
use crate::vk::{Device, Presenter};
use std::sync::Arc;

/// Opens a device, with what shows pictures on it if anything does.
pub type Open = Box<dyn FnMut() -> Result<(Arc<Device>, Option<Presenter>)>>;

/// Goes on after a fault, if that is a lost device.
///
/// # Errors
/// The fault, if it is another or a device was lost a short time ago; what keeps a device from being opened.
pub fn recover(fault: Error, viewer: &mut Viewer, screen: &mut Screen, open: &mut Open) -> Result<()> {
    let said = fault.to_string();
    viewer.session_mut().outlive(fault)?;
    // A window has one swapchain at a time.
    screen.close();
    let (device, presenter) = open()?;
    viewer.session_mut().replace_device(Arc::clone(&device))?;
    screen.replace(&device, viewer.session().size(), presenter)?;
    viewer.show_anew();
    viewer.say(format!("{said}; it was opened again"));
    Ok(())
}
