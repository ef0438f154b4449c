//! The frame, from what changed to the picture.

use super::colouring::Projector;
use super::mesh::Batch;
use super::plan::{Plan, Visible, choose_counted};
use super::renderer::Renderer;
use super::scene_buffers::fitting_scale;
use super::shared::FrameUniform;
use crate::error::Result;
use crate::refine::update::{LeafId, LeafPixels};
use crate::scene::Display;
use crate::vk::timestamp::PassTimes;

/// How changed patches get into the luminance images (method.md 7).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum UpdateMode {
    /// The paper's: old triangles mark the stencil by depth EQUAL, new ones draw where they did.
    #[default]
    Stencil,
    /// New triangles where the face-id image shows their face.
    Id,
}

impl UpdateMode {
    /// All modes with the names that options use.
    pub const NAMES: [(&'static str, Self); 2] = [("stencil", Self::Stencil), ("id", Self::Id)];

    /// The name that options and reports use.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Stencil => "stencil",
            Self::Id => "id",
        }
    }
}

/// What a frame does.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FrameOptions {
    /// Draw every leaf of every visible face (the camera moved).
    pub full_luminance: bool,
    /// Look the colours up again (the camera moved).
    pub colour: bool,
    /// Make the picture, with these settings.
    pub combine: Option<Display>,
    /// How patches are drawn.
    pub update_mode: UpdateMode,
    /// Leaves whose pixels are counted by occlusion queries as they change, at most (0 without precise queries): each
    /// costs a draw of its own.
    pub queries: u32,
}

/// Leaves of patches drawn in a frame, at most; others wait for the next. Half of a frame at 30 Hz on a software rasteriser.
const LEAVES_A_FRAME: usize = 8192;

/// What a frame did. Times are on the device's clock, since the frame before; a pass that did not run has none.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FrameStats {
    /// Milliseconds of the visibility pass.
    pub visibility_ms: Option<f64>,
    /// Milliseconds of the colour pass.
    pub colour_ms: Option<f64>,
    /// Milliseconds of the luminance pass.
    pub luminance_ms: Option<f64>,
    /// Milliseconds of the combine pass.
    pub combine_ms: Option<f64>,
    /// Milliseconds of copies to the host.
    pub readback_ms: Option<f64>,
    /// Patches drawn.
    pub patches: u32,
    /// Leaves drawn.
    pub leaves_drawn: u32,
    /// Occlusion queries issued.
    pub queries: u32,
    /// Pixels that they counted.
    pub query_pixels: u64,
}

impl FrameStats {
    fn new(times: &PassTimes, patches: u32, plan: &Plan, counts: &[LeafPixels]) -> Self {
        Self {
            visibility_ms: times.ms("visibility"),
            colour_ms: times.ms("colour"),
            luminance_ms: times.ms("luminance"),
            combine_ms: times.ms("combine"),
            readback_ms: times.ms("readback"),
            patches,
            leaves_drawn: plan.leaves_drawn,
            queries: counts.len() as u32,
            query_pixels: counts.iter().map(|leaf| u64::from(leaf.pixels)).sum(),
        }
    }
}

impl Renderer {
    /// Draws a frame: colour if asked, the luminance that changed (or all of it), the picture if asked.
    ///
    /// # Errors
    /// [`crate::error::Error::Exhausted`] when the device is lost or memory runs out.
    pub fn frame(&mut self, options: &FrameOptions) -> Result<FrameStats> {
        let (mut plan, patches) = self.plan(options);
        self.send(&mut plan, options.combine)?;
        let Self { commands, passes, bindings, targets, queries, .. } = self;
        let mut recording = commands.begin()?;
        if options.colour {
            recording.pass("colour", |pass| passes.colour.record(pass, bindings, targets));
        }
        if plan.clear || !plan.steps.is_empty() {
            recording
                .pass("luminance", |pass| passes.luminance.record(pass, bindings, targets, &plan, queries.as_ref()));
        }
        if options.combine.is_some() {
            recording.pass("combine", |pass| passes.combine.record(pass, bindings, targets));
        }
        let times = recording.submit()?;
        self.times.extend(times);
        self.query_counts.clear();
        if let Some(queries) = &self.queries {
            let pixels = queries.read(plan.queried.len() as u32)?;
            let leaves = plan.queried.iter().map(|&(leaf, _)| LeafId(leaf));
            self.query_counts.extend(leaves.zip(pixels).map(|(leaf, pixels)| LeafPixels { leaf, pixels, ray: None }));
        }
        Ok(FrameStats::new(&std::mem::take(&mut self.times), patches, &plan, &self.query_counts))
    }

    /// What the luminance pass draws, and the number of patches in it.
    fn plan(&mut self, options: &FrameOptions) -> (Plan, u32) {
        let mode = if self.stencil_works { options.update_mode } else { UpdateMode::Id };
        let overflow = self.mesh.max_value() * self.luminance_scale > f32::from(half::f16::MAX);
        // Updates by id leave the depth of the old triangles behind: marking by depth needs it drawn again.
        let stale = mode == UpdateMode::Stencil && !self.depth_is_current && self.mesh.has_pending();
        let visible = Visible { faces: &self.visible, masked: &self.scene.masked };
        if options.full_luminance || overflow || stale || self.mesh.needs_full() {
            self.luminance_scale = fitting_scale(self.mesh.max_value());
            self.depth_is_current = true;
            let patches = self.mesh.take_full();
            return (Plan::full(&self.mesh, &visible), patches);
        }
        let mut batches = self.mesh.take_pending(LEAVES_A_FRAME);
        let patches = batches.iter().map(Batch::patches).sum();
        let projector = Projector::new(&self.view, self.jitter);
        let queries = self.queries.as_ref().map_or(0, |queries| queries.capacity().min(options.queries));
        choose_counted(&mut batches, &self.mesh, &visible, &projector, queries as usize);
        let plan = match mode {
            UpdateMode::Stencil => Plan::stencil(&self.mesh, &visible, &batches, &projector, self.targets.size),
            UpdateMode::Id => {
                self.depth_is_current &= batches.is_empty();
                Plan::on_face(&self.mesh, &visible, &batches)
            }
        };
        (plan, patches)
    }

    /// Sends what the shaders read.
    fn send(&mut self, plan: &mut Plan, display: Option<Display>) -> Result<()> {
        self.mesh.slots.flush(&self.device)?;
        self.mesh.leaves.flush(&self.device)?;
        self.leaf_list.replace(std::mem::take(&mut plan.list));
        self.leaf_list.flush(&self.device)?;
        self.marks.replace(std::mem::take(&mut plan.marks));
        self.marks.flush(&self.device)?;
        self.send_uniform(display)
    }

    /// Sends the uniform block alone.
    pub(super) fn send_uniform(&mut self, display: Option<Display>) -> Result<()> {
        let display = display.unwrap_or_default();
        let (scene, view, size) = (&self.scene, &self.view, self.targets.size);
        let uniform = FrameUniform {
            clip_from_world: view.clip_from_world(self.jitter).to_cols_array(),
            positions: scene.positions.address(),
            triangles: scene.triangles.address(),
            drawn: scene.drawn.address(),
            materials: scene.materials.address(),
            textures: scene.textures.address(),
            texels: scene.texels.address(),
            slots: self.mesh.slots.address(),
            leaves: self.mesh.leaves.address(),
            leaf_list: self.leaf_list.address(),
            marks: self.marks.address(),
            eye: view.eye.to_array(),
            forward: view.forward.to_array(),
            right: view.right.to_array(),
            down: view.down.to_array(),
            pixel: [2.0 / size.width as f32, 2.0 / size.height as f32],
            jitter: self.jitter.to_array(),
            luminance_scale: self.luminance_scale,
            emission_scale: scene.emission_scale,
            exposure: display.exposure.exp2(),
            tone_mapping: display.tone_mapping as u32,
            emits_back: u32::from(scene.emits_back),
            filter_width: self.filter_width,
        };
        self.uniform.write(0, &[uniform])
    }
}
