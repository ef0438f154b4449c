//! Update modes: how changed patches get into the luminance images (docs/method/updates.md). A file a mode, all of one
//! shape.
//!
//! docs/update-modes.md compares them.

mod depth_bias;
mod depth_equal;
mod depth_less_equal;
mod full;
mod id;
mod lookup;
mod shape;
mod stencil;
mod stencil_export;

pub(super) use shape::Context;

use super::mesh::Batch;
use super::plan::Plan;
use crate::error::{Error, Result};
use crate::vk::DeviceReport;
use shape::Shape;

/// How changed patches get into the luminance images.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Hash)]
pub enum UpdateMode {
    /// The paper's: old triangles mark the stencil by depth EQUAL, new ones draw where they did.
    Stencil,
    /// New triangles where the face-id image shows their face: the default, by the figures of
    /// docs/notebook/update-modes.md.
    #[default]
    Id,
    /// New triangles where they are not farther than what was drawn last.
    DepthLessEqual,
    /// New triangles where they are exactly as far as what was drawn last.
    DepthEqual,
    /// New triangles, brought a little nearer, where they are not farther than what was drawn first.
    DepthBias,
    /// All triangles, whatever changed.
    Full,
    /// As `Stencil`, each fragment bringing its own reference: two draws for all patches.
    StencilExport,
    /// No triangles: pixels of changed drawn triangles find them from face id and barycentrics.
    Lookup,
}

impl UpdateMode {
    /// All modes.
    pub const ALL: [Self; 8] = [
        Self::Stencil,
        Self::Id,
        Self::DepthLessEqual,
        Self::DepthEqual,
        Self::DepthBias,
        Self::Full,
        Self::StencilExport,
        Self::Lookup,
    ];

    const fn shape(self) -> &'static Shape {
        match self {
            Self::Stencil => &stencil::SHAPE,
            Self::Id => &id::SHAPE,
            Self::DepthLessEqual => &depth_less_equal::SHAPE,
            Self::DepthEqual => &depth_equal::SHAPE,
            Self::DepthBias => &depth_bias::SHAPE,
            Self::Full => &full::SHAPE,
            Self::StencilExport => &stencil_export::SHAPE,
            Self::Lookup => &lookup::SHAPE,
        }
    }

    /// The name that options and reports use.
    #[must_use]
    pub const fn name(self) -> &'static str {
        self.shape().name
    }

    /// The mode of a name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|mode| mode.name() == name)
    }

    /// Whether it needs a stencil beside the depth.
    #[must_use]
    pub const fn needs_stencil(self) -> bool {
        self.shape().stencil
    }

    /// Whether it finds the pixels of a patch by the image of face ids, not by depth.
    #[must_use]
    pub const fn goes_by_face(self) -> bool {
        matches!(self, Self::Id | Self::Lookup)
    }

    /// Whether it has pipelines of its own.
    pub(super) const fn needs_pipelines(self) -> bool {
        matches!(self, Self::StencilExport | Self::Lookup)
    }

    /// Plans the draws of all that changed, in order.
    pub(super) fn plan(self, context: &Context<'_>, batches: &[Batch]) -> Plan {
        let mut plan = Plan::default();
        batches.iter().for_each(|batch| (self.shape().draw)(&mut plan, context, batch));
        plan
    }

    pub(super) const fn reads_depth(self) -> bool {
        self.shape().reads_depth
    }

    /// Whether a device has what the mode needs.
    ///
    /// # Errors
    /// [`Error::NoDevice`] naming the feature that it lacks.
    pub fn check(self, device: &DeviceReport) -> Result<()> {
        match (self.shape().lacks)(device) {
            None => Ok(()),
            Some(feature) => Err(Error::NoDevice(format!(
                "{} lacks {feature}, which --update {} needs; take --update stencil or id",
                device.name,
                self.name()
            ))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_mode_is_found_by_its_name() {
        for mode in UpdateMode::ALL {
            assert_eq!(UpdateMode::named(mode.name()), Some(mode));
        }
        assert_eq!(UpdateMode::named("ids"), None);
    }
}
