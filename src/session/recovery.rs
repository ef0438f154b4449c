//! A device that is lost: the renderer is made anew on another, and is sent what the engine has found.

use super::Session;
use super::visible::visible_faces;
use crate::error::{Error, Result};
use crate::pass::{FrameOptions, Renderer};
use crate::vk::{Device, DeviceOptions};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// A device that is lost again within this time is not made anew: whatever lost it is still there.
const SOON: Duration = Duration::from_secs(30);

impl Session {
    /// Notes a fault of the device; what comes next is [`Self::replace_device`].
    ///
    /// # Errors
    /// The fault, if it is another than a lost device, or one was lost a short time ago.
    pub fn outlive(&mut self, fault: Error) -> Result<()> {
        let again = self.lost.is_some_and(|before| before.elapsed() < SOON);
        if again || !matches!(fault, Error::DeviceLost(_)) {
            return Err(fault);
        }
        self.lost = Some(Instant::now());
        Ok(())
    }

    /// Goes on after a fault if it is a lost device: that of the options is opened again.
    ///
    /// # Errors
    /// As [`Self::outlive`] and [`Self::replace_device`]; [`Error::NoDevice`] if no device is left.
    pub fn recover(&mut self, fault: Error) -> Result<()> {
        self.outlive(fault)?;
        self.replace_device(Device::new(&DeviceOptions { device: self.options.device.clone(), validation: None })?)
    }

    /// Takes a device in place of the present one. Its images show what those of the other showed last, and whatever the engine has
    /// found since.
    ///
    /// # Errors
    /// [`Error::NoDevice`] for a device that cannot do what the options ask, [`Error::Exhausted`] when memory runs out;
    /// [`Error::Internal`] if the engine has stopped.
    pub fn replace_device(&mut self, device: Arc<Device>) -> Result<()> {
        let options = self.options.renderer_options(&device)?;
        let mut renderer = Renderer::with_options(device, self.options.size, options)?;
        renderer.load(&self.scene)?;
        renderer.resize(self.options.size)?;
        self.renderer = renderer;
        // The numbers of drawn triangles are gone.
        (self.debug.answered, self.debug.asked) = (None, None);
        let Some(shot) = &self.shot else { return Ok(()) };
        self.renderer.relight(&shot.lights)?;
        visible_faces(&mut self.renderer, &shot.view, self.options.redraws)?;
        let whole = self.engine.whole()?;
        self.apply(&[whole])?;
        let update_mode = self.options.update;
        let combine = Some(self.display);
        self.renderer.frame(&FrameOptions { colour: true, full_luminance: true, combine, update_mode, queries: 0 })?;
        Ok(())
    }

    /// Loses the device if the options ask for it in the coming frame.
    pub(super) fn lose_device_if_asked(&mut self) {
        let asked = &mut self.options.lose_device_at;
        if let Some(index) = asked.iter().position(|&at| at == self.frames) {
            asked.swap_remove(index);
            self.renderer.device().lose();
        }
    }
}
