//! Visibility: face ids and depth of everything the camera sees, and how many pixels each face covers.

use super::depth::Depth;
use super::needs::Needs;
use super::options::RendererOptions;
use super::scene_buffers::SceneBuffers;
use super::targets::Targets;
use crate::error::Result;
use crate::scene::FaceId;
use crate::vk::commands::Load;
use crate::vk::pipeline::{ColourWrites, PipelineDesc};
use crate::vk::report::ID_FORMAT;
use crate::vk::{Bindings, Device, Pass, Pipeline, shaders};

/// The pass of that name.
pub(super) struct Visibility {
    opaque: Pipeline,
    masked: Pipeline,
    coplanar: Pipeline,
    depth: Depth,
}

/// What the pass draws, as (first triangle, triangles).
pub(super) struct VisibilityDraws {
    /// Triangles without mask.
    pub opaque: Vec<(u32, u32)>,
    /// Triangles with one.
    pub masked: Vec<(u32, u32)>,
    /// Whether occluders are there already. They are among what is drawn without mask, which then comes in reverse order, and of what is
    /// equally near the last is seen: as if all had been drawn in order, and the first seen.
    pub over_occluders: bool,
}

impl VisibilityDraws {
    /// Triangles that it draws.
    pub(super) fn triangles(&self) -> u32 {
        self.opaque.iter().chain(&self.masked).map(|(_, count)| count).sum()
    }
}

impl Visibility {
    pub(super) fn new(device: &Device, bindings: &Bindings, options: &RendererOptions) -> Result<Self> {
        let depth = options.depth;
        let desc = PipelineDesc {
            vertex: shaders::VISIBILITY_VERT,
            fragment: Some(shaders::VISIBILITY_FRAG),
            colour: &[ID_FORMAT],
            depth_stencil: Some(depth.format),
            colour_writes: ColourWrites::Replace,
            constants: &Needs::COMMON.constants(options),
        };
        let with_mask = PipelineDesc {
            vertex: shaders::VISIBILITY_MASKED_VERT,
            fragment: Some(shaders::VISIBILITY_MASKED_FRAG),
            ..desc
        };
        let coplanar = PipelineDesc {
            vertex: shaders::VISIBILITY_COPLANAR_VERT,
            fragment: Some(shaders::VISIBILITY_COPLANAR_FRAG),
            ..desc
        };
        Ok(Self {
            opaque: Pipeline::new(device, "visibility", bindings, &desc)?,
            masked: Pipeline::new(device, "visibility masked", bindings, &with_mask)?,
            coplanar: Pipeline::new(device, "visibility coplanar", bindings, &coplanar)?,
            depth,
        })
    }

    /// Draws what may hide most of the rest: triangles without mask.
    pub(super) fn record_occluders<'a>(
        &'a self,
        pass: &Pass<'a>,
        bindings: &'a Bindings,
        targets: &'a Targets,
        (first, count): (u32, u32),
    ) {
        pass.render(&[&targets.ids], Some(&targets.visibility_depth), Load::Clear(self.depth.infinity()), |draws| {
            draws.bind(&self.opaque, bindings);
            draws.depth_stencil(self.depth.nearer());
            draws.triangles(first, count);
        });
    }

    /// Draws what may show, triangles without mask first so that the others are mostly hidden by depth; last what shares a plane, of
    /// which the order decides.
    pub(super) fn record<'a>(
        &'a self,
        pass: &Pass<'a>,
        bindings: &'a Bindings,
        targets: &'a Targets,
        scene: &SceneBuffers,
        VisibilityDraws { opaque, masked, over_occluders }: &VisibilityDraws,
    ) {
        let load = if *over_occluders { Load::Keep } else { Load::Clear(self.depth.infinity()) };
        pass.render(&[&targets.ids], Some(&targets.visibility_depth), load, |draws| {
            draws.bind(&self.opaque, bindings);
            draws.depth_stencil(if *over_occluders { self.depth.nearer_or_later() } else { self.depth.nearer() });
            opaque.iter().for_each(|&(first, count)| draws.triangles(first, count));
            if !masked.is_empty() {
                draws.bind(&self.masked, bindings);
                draws.depth_stencil(self.depth.nearer());
                masked.iter().for_each(|&(first, count)| draws.triangles(first, count));
            }
            if scene.coplanar_count > 0 {
                draws.bind(&self.coplanar, bindings);
                draws.depth_stencil(self.depth.nearer_or_later());
                draws.triangles(0, scene.coplanar_count);
            }
        });
    }
}

/// Pixels of each visible face, by face, from an id image; `faces` is the number of faces of the scene.
pub(super) fn count_pixels(ids: &[u32], faces: usize) -> Vec<(FaceId, u32)> {
    // A table of all faces beats a hash map and a GPU reduction alike: 0.1 to 0.4 ms (docs/lavapipe.md).
    let mut counts = vec![0u32; faces + 1];
    for &id in ids {
        if let Some(count) = counts.get_mut(id as usize) {
            *count += 1;
        }
    }
    let seen = counts.iter().enumerate().skip(1).filter(|&(_, &count)| count > 0);
    seen.map(|(id, &count)| (FaceId(id as u32 - 1), count)).collect()
}
