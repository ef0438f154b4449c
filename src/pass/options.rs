//! What a renderer is made for.

use super::depth::{Depth, DepthOrder};
use super::update::UpdateMode;
use crate::error::{Error, Result};
use crate::vk::Device;

/// What a renderer is made for.
#[derive(Clone, Debug, PartialEq)]
pub struct RendererOptions {
    /// How depth is kept.
    pub depth: Depth,
    /// Update modes that its frames may ask for.
    pub modes: Vec<UpdateMode>,
    /// Whether to count how often each pixel is written ([`super::Renderer::read_luminance`]).
    pub count_writes: bool,
    /// Whether the pixels of changed drawn triangles are counted as they are drawn
    /// ([`super::Renderer::atomic_counts`]).
    pub atomic_counts: bool,
    /// Whether shaders read the scene and the light as texels, where the device can view them whole, and not by device address:
    /// faster on a CPU (docs/lavapipe.md).
    pub texel_buffers: bool,
    /// Whether the host leaves out triangles inside the view frustum that cannot show, and looks at depth for it in the middle of a
    /// visibility pass: only where the device is a CPU, too.
    pub culls_on_host: bool,
    /// Whether pipelines are made anew for what the scene needs when it is loaded: more to compile before the first frame, and less to do in
    /// each.
    pub tailored: bool,
}

impl RendererOptions {
    /// The best depth, the modes `stencil` and `id`, nothing counted.
    ///
    /// # Errors
    /// None: the device was chosen for having such a format.
    pub fn new(device: &Device) -> Result<Self> {
        let depth = Depth::new(device, None, DepthOrder::default())?;
        let modes = vec![UpdateMode::Stencil, UpdateMode::Id];
        let is_cpu = device.report().is_cpu();
        Ok(Self {
            depth,
            modes,
            count_writes: false,
            atomic_counts: false,
            texel_buffers: is_cpu,
            culls_on_host: is_cpu,
            tailored: false,
        })
    }

    /// Whether a device can do what is asked for.
    ///
    /// # Errors
    /// [`Error::NoDevice`] naming a feature that it lacks, [`Error::Usage`] for what does not go together.
    pub fn check(&self, device: &Device) -> Result<()> {
        let report = device.report();
        for &mode in &self.modes {
            mode.check(report)?;
            self.depth.check(mode)?;
            if self.atomic_counts && mode == UpdateMode::StencilExport {
                let message = "--pixel-counts atomic: with --update stencil-export fragments are tested after they count; \
                    take query or image";
                return Err(Error::Usage(message.to_owned()));
            }
        }
        let lacks =
            |feature: &str, what: &str| Error::NoDevice(format!("{} lacks {feature}, which {what} needs", report.name));
        if self.atomic_counts && !report.optional.fragment_atomics {
            return Err(lacks("the feature fragmentStoresAndAtomics", "--pixel-counts atomic"));
        }
        if self.count_writes && !report.optional.independent_blend {
            return Err(lacks("the feature independentBlend", "counting the writes of pixels"));
        }
        Ok(())
    }
}
