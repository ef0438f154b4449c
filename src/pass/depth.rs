//! Depth: in which format it is kept, and which end of its range is near.

use super::update::UpdateMode;
use crate::error::{Error, Result};
use crate::vk::Device;
use crate::vk::pipeline::DepthStencil;
use ash::vk::{CompareOp, Format};
use glam::{Mat4, Vec4};

/// Formats of depth images.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DepthFormat {
    /// 32-bit float, and stencil.
    D32S8,
    /// 24-bit integer, and stencil.
    D24S8,
    /// 16-bit integer, no stencil.
    D16,
}

impl DepthFormat {
    /// All formats with the names that options use.
    pub const NAMES: [(&'static str, Self); 3] = [("d32s8", Self::D32S8), ("d24s8", Self::D24S8), ("d16", Self::D16)];

    /// The name that options and reports use.
    #[must_use]
    pub const fn name(self) -> &'static str {
        Self::NAMES[self as usize].0
    }

    /// Whether there is a stencil beside the depth.
    #[must_use]
    pub const fn has_stencil(self) -> bool {
        !matches!(self, Self::D16)
    }

    const fn vulkan(self) -> Format {
        match self {
            Self::D32S8 => Format::D32_SFLOAT_S8_UINT,
            Self::D24S8 => Format::D24_UNORM_S8_UINT,
            Self::D16 => Format::D16_UNORM,
        }
    }
}

/// Which end of the range of depths is near.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum DepthOrder {
    /// 1 near, 0 infinitely far: floats are dense where distances need it.
    #[default]
    Reversed,
    /// 0 near, 1 infinitely far.
    Ordinary,
}

impl DepthOrder {
    /// Both orders with the names that options use.
    pub const NAMES: [(&'static str, Self); 2] = [("reversed", Self::Reversed), ("ordinary", Self::Ordinary)];

    /// The name that options and reports use.
    #[must_use]
    pub const fn name(self) -> &'static str {
        Self::NAMES[self as usize].0
    }
}

/// How depth is kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Depth {
    pub(super) format: Format,
    pub(super) order: DepthOrder,
}

impl Depth {
    /// Depth in a format, or in the best that the device has with a stencil.
    ///
    /// # Errors
    /// [`Error::NoDevice`] if the device cannot render to images of this format.
    pub fn new(device: &Device, format: Option<DepthFormat>, order: DepthOrder) -> Result<Self> {
        let Some(format) = format else { return Ok(Self { format: device.depth_stencil_format(), order }) };
        let (wanted, report) = (format!("{:?}", format.vulkan()), device.report());
        if report.optional.depth_formats.contains(&wanted) {
            return Ok(Self { format: format.vulkan(), order });
        }
        let has = report.optional.depth_formats.join(", ");
        Err(Error::NoDevice(format!(
            "{} lacks depth images of the format {wanted}, which --depth-format {} needs; it has {has}",
            report.name,
            format.name()
        )))
    }

    /// Name of the format, as Vulkan has it.
    #[must_use]
    pub fn format_name(&self) -> String {
        format!("{:?}", self.format)
    }

    /// Whether there is a stencil beside the depth.
    #[must_use]
    pub fn has_stencil(&self) -> bool {
        self.format != Format::D16_UNORM
    }

    /// The depth of what is infinitely far.
    pub(super) const fn infinity(self) -> f32 {
        match self.order {
            DepthOrder::Reversed => 0.0,
            DepthOrder::Ordinary => 1.0,
        }
    }

    /// Depth of the background: farther than any drawn triangle but nearer than nothing, no less than a step of 16-bit depth. Reversed
    /// floats are dense enough there for drawn triangles that are a billion times as far as the near plane.
    pub(super) const fn background(self) -> f32 {
        match (self.order, self.format) {
            (DepthOrder::Reversed, Format::D32_SFLOAT_S8_UINT) => 1e-20,
            (DepthOrder::Reversed, _) => 2e-5,
            (DepthOrder::Ordinary, _) => 1.0 - 2e-5,
        }
    }

    /// Nearer than what is there, and written.
    pub(super) const fn nearer(self) -> DepthStencil {
        let compare = match self.order {
            DepthOrder::Reversed => CompareOp::GREATER,
            DepthOrder::Ordinary => CompareOp::LESS,
        };
        DepthStencil { compare, write: true, stencil: None, bias: None }
    }

    /// The same, or as near, by the order of drawing.
    pub(super) const fn nearer_or_later(self) -> DepthStencil {
        DepthStencil { compare: self.not_farther(), ..self.nearer() }
    }

    /// Not farther than what is there.
    pub(super) const fn not_farther(self) -> CompareOp {
        match self.order {
            DepthOrder::Reversed => CompareOp::GREATER_OR_EQUAL,
            DepthOrder::Ordinary => CompareOp::LESS_OR_EQUAL,
        }
    }

    /// Whether the host can read it as it is: reversed, a float.
    pub(super) const fn is_reversed_float(self) -> bool {
        matches!((self.order, self.format), (DepthOrder::Reversed, Format::D32_SFLOAT_S8_UINT))
    }

    /// 1 if greater depth is nearer, else −1.
    pub(super) const fn towards_the_eye(self) -> f32 {
        match self.order {
            DepthOrder::Reversed => 1.0,
            DepthOrder::Ordinary => -1.0,
        }
    }

    /// The transform of a view, whose depth is reversed, to this order: z' = w − z.
    pub(super) fn clip(self, reversed: Mat4) -> Mat4 {
        match self.order {
            DepthOrder::Reversed => reversed,
            DepthOrder::Ordinary => {
                Mat4::from_cols(Vec4::X, Vec4::Y, -Vec4::Z, Vec4::new(0.0, 0.0, 1.0, 1.0)) * reversed
            }
        }
    }

    /// Depth of what is d ahead, as factor of 1 / d and summand: that of [`Self::clip`] for a near plane.
    pub(super) const fn of_inverse(self, near: f32) -> [f32; 2] {
        match self.order {
            DepthOrder::Reversed => [near, 0.0],
            DepthOrder::Ordinary => [-near, 1.0],
        }
    }

    /// Whether a mode can work on this depth.
    ///
    /// # Errors
    /// [`Error::Usage`] if the mode needs a stencil and there is none.
    pub fn check(&self, mode: UpdateMode) -> Result<()> {
        if self.has_stencil() || !mode.needs_stencil() {
            return Ok(());
        }
        Err(Error::Usage(format!(
            "--depth-format d16 has no stencil, which --update {} needs; take d32s8 or d24s8, or --update id",
            mode.name()
        )))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::camera::{Camera, ImageSize, View};
    use glam::{Vec2, Vec3};

    #[test]
    fn both_orders_rank_alike() {
        let camera = Camera { position: Vec3::ZERO, look_at: Vec3::NEG_Z, up: Vec3::Y, vertical_fov: 45.0 };
        let view = View { near: 0.1, ..View::new(&camera, ImageSize { width: 4, height: 3 }, 1.0) };
        let reversed = view.clip_from_world(Vec2::ZERO);
        let depths = |order| {
            let clip = Depth { format: Format::D32_SFLOAT_S8_UINT, order }.clip(reversed);
            [0.1, 1.0, 1e3].map(|d| clip.project_point3(Vec3::new(0.0, 0.0, -d)).z)
        };
        let (reversed, ordinary) = (depths(DepthOrder::Reversed), depths(DepthOrder::Ordinary));
        assert!((reversed[0] - 1.0).abs() < 1e-6 && ordinary[0].abs() < 1e-6, "the near plane");
        for (r, o) in reversed.into_iter().zip(ordinary) {
            assert!((r + o - 1.0).abs() < 1e-6, "{r} {o}");
        }
        for order in [DepthOrder::Reversed, DepthOrder::Ordinary] {
            let [factor, summand] = Depth { format: Format::D32_SFLOAT_S8_UINT, order }.of_inverse(view.near);
            let middle = if order == DepthOrder::Reversed { reversed[1] } else { ordinary[1] };
            assert!((factor / 1.0 + summand - middle).abs() < 1e-6, "{order:?}");
        }
    }

    #[test]
    fn names_are_those_of_the_values() {
        DepthFormat::NAMES.iter().for_each(|(name, format)| assert_eq!(format.name(), *name));
        DepthOrder::NAMES.iter().for_each(|(name, order)| assert_eq!(order.name(), *name));
    }
}
