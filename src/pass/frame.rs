//! The frame, from what changed to the picture.

use super::colouring::Projector;
use super::frustum::Frustum;
use super::mesh::Batch;
use super::plan::{Clipping, Plan, Visible, choose_counted};
use super::renderer::Renderer;
use super::scene_buffers::fitting_scale;
use super::shared::FrameUniform;
use super::update::{Context, UpdateMode};
use crate::error::Result;
use crate::refine::update::{DrawnId, DrawnPixels};
use crate::scene::Display;
use crate::trace::{self, within};
use crate::vk::Buffer;
use crate::vk::timestamp::PassTimes;

/// What a frame does.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FrameOptions {
    /// Draw every drawn triangle of every visible face (the camera moved).
    pub full_luminance: bool,
    /// Look the colours up again (the camera moved).
    pub colour: bool,
    /// Make the picture, with these settings.
    pub combine: Option<Display>,
    /// How patches are drawn.
    pub update_mode: UpdateMode,
    /// Drawn triangles whose pixels are counted by occlusion queries as they change, at most (0 without precise queries): each
    /// costs a draw of its own.
    pub queries: u32,
}

/// Triangles of patches drawn in a frame, at most; others wait for the next. Half of a frame at 30 Hz on a software
/// rasteriser.
const TRIANGLES_A_FRAME: usize = 8192;

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
    /// Triangles drawn.
    pub triangles_drawn: u32,
    /// Draw commands of the luminance pass.
    pub draws: u32,
    /// Whether all drawn triangles were drawn, not changed ones alone.
    pub full: bool,
    /// Occlusion queries issued.
    pub queries: u32,
    /// Pixels that they counted.
    pub query_pixels: u64,
}

impl FrameStats {
    fn new(times: &PassTimes, patches: u32, plan: &Plan, counts: &[DrawnPixels]) -> Self {
        Self {
            visibility_ms: times.ms("visibility"),
            colour_ms: times.ms("colour"),
            luminance_ms: times.ms("luminance"),
            combine_ms: times.ms("combine"),
            readback_ms: times.ms("readback"),
            patches,
            triangles_drawn: plan.triangles_drawn,
            draws: plan.draws(),
            full: plan.clear,
            queries: counts.len() as u32,
            query_pixels: counts.iter().map(|count| u64::from(count.pixels)).sum(),
        }
    }
}

impl Renderer {
    /// Draws a frame: colour if asked, the luminance that changed (or all of it), the picture if asked.
    ///
    /// # Errors
    /// [`crate::error::Error::DeviceLost`], [`crate::error::Error::Exhausted`] when memory runs out.
    pub fn frame(&mut self, options: &FrameOptions) -> Result<FrameStats> {
        let (mut plan, patches) = within("plan", || self.plan(options));
        within("send", || self.send(&mut plan, options.combine))?;
        if let Some(display) = options.combine {
            self.passes.combine.show_with(display.tone_mapping, &self.device, &self.bindings)?;
            self.debug.prepare(&self.device, &self.uniform, &self.targets, display)?;
        }
        let Self { commands, passes, bindings, targets, queries, debug, .. } = self;
        let record = trace::span("record");
        let mut recording = commands.begin()?;
        if options.colour {
            recording.pass("colour", |pass| passes.colour.record(pass, bindings, targets));
        }
        if plan.clear || !plan.steps.is_empty() {
            recording
                .pass("luminance", |pass| passes.luminance.record(pass, bindings, targets, &plan, queries.as_ref()));
        }
        if options.combine.is_some() {
            recording.pass("combine", |pass| {
                if !debug.record(pass, targets) {
                    passes.combine.record(pass, bindings, targets);
                }
            });
        }
        drop(record);
        let times = recording.submit()?;
        self.mesh.drop_filling();
        self.times.extend(times);
        if self.options.atomic_counts {
            self.counters.read(&plan)?;
        }
        self.query_counts.clear();
        if let Some(queries) = &self.queries {
            let pixels = queries.read(plan.queried.len() as u32)?;
            let drawn_triangles = plan.queried.iter().map(|&(id, _)| DrawnId(id));
            self.query_counts.extend(drawn_triangles.zip(pixels).map(|(drawn, pixels)| DrawnPixels { drawn, pixels }));
        }
        Ok(FrameStats::new(&std::mem::take(&mut self.times), patches, &plan, &self.query_counts))
    }

    /// The mode that frames draw in: `id` where the device cannot do what the stencil needs, or the renderer was not made for
    /// the mode.
    fn mode(&self, asked: UpdateMode) -> UpdateMode {
        let is_made = self.options.modes.contains(&asked) || !asked.needs_pipelines();
        let works = is_made && (self.stencil_works || !asked.needs_stencil());
        if works { asked } else { UpdateMode::Id }
    }

    /// Whether the next frame draws all drawn triangles of visible faces even if it is not asked to.
    #[must_use]
    pub fn must_draw_all(&self, update_mode: UpdateMode) -> bool {
        let mode = self.mode(update_mode);
        let overflow = self.mesh.max_value() * self.luminance_scale > f32::from(half::f16::MAX);
        // Depth that another mode left behind: what tests against it needs it drawn again.
        let stale = mode.reads_depth() && self.depth_left_by.is_some_and(|left_by| left_by != mode);
        let redraw = stale || mode == UpdateMode::Full;
        overflow || self.mesh.needs_full() || (redraw && self.mesh.has_pending())
    }

    /// What the luminance pass draws, and the number of patches in it.
    fn plan(&mut self, options: &FrameOptions) -> (Plan, u32) {
        let mode = self.mode(options.update_mode);
        let visible = Visible { faces: &self.visible, by_id: &self.scene.by_id };
        if options.full_luminance || self.must_draw_all(options.update_mode) {
            self.luminance_scale = fitting_scale(self.mesh.max_value());
            self.depth_left_by = None;
            let patches = self.mesh.take_full();
            let looks_up = mode == UpdateMode::Lookup && self.lookup.is_some();
            let frustum = Frustum::new(&self.view, self.jitter);
            let clipping = Clipping { frustum: &frustum, places: &self.places };
            let plan =
                if looks_up { Plan::full_lookup(&self.mesh) } else { Plan::full(&self.mesh, &visible, &clipping) };
            return (plan, patches);
        }
        // One draw looks all up: what is drawn later would be shown early.
        let budget = if mode == UpdateMode::Lookup { usize::MAX } else { TRIANGLES_A_FRAME };
        let mut batches = self.mesh.take_pending(budget);
        let patches = batches.iter().map(Batch::patches).sum();
        self.depth_left_by = if patches > 0 { Some(mode) } else { self.depth_left_by };
        let projector = Projector::new(&self.view, self.jitter);
        let queries = self.queries.as_ref().map_or(0, |queries| queries.capacity().min(options.queries));
        choose_counted(&mut batches, &self.mesh, &visible, &projector, queries as usize);
        let context = Context { mesh: &self.mesh, visible: &visible, projector: &projector, size: self.targets.size };
        (mode.plan(&context, &batches), patches)
    }

    /// Sends what the shaders read.
    fn send(&mut self, plan: &mut Plan, display: Option<Display>) -> Result<()> {
        self.mesh.slots.flush(&self.device)?;
        self.mesh.light_vectors.flush(&self.device)?;
        self.mesh.drawn_triangles.flush(&self.device)?;
        self.drawn_list.replace(plan.list.clone());
        self.drawn_list.flush(&self.device)?;
        self.marks.replace(std::mem::take(&mut plan.marks));
        self.marks.flush(&self.device)?;
        self.list_references.replace(std::mem::take(&mut plan.list_references));
        self.list_references.flush(&self.device)?;
        self.mark_references.replace(std::mem::take(&mut plan.mark_references));
        self.mark_references.flush(&self.device)?;
        if let Some(lookup) = &mut self.lookup {
            lookup.nodes.flush(&self.device)?;
            lookup.roots.flush(&self.device)?;
            let changed = lookup.take_changed();
            self.lookup_stamp = if plan.clear { 0 } else { changed };
        }
        if self.options.atomic_counts {
            self.counters.reserve(&self.device, self.mesh.drawn_triangles.len())?;
        }
        self.bind_texel_buffers()?;
        self.send_uniform(display)
    }

    /// Sends the uniform block alone.
    pub(super) fn send_uniform(&mut self, display: Option<Display>) -> Result<()> {
        let display = display.unwrap_or_default();
        let (scene, view, size) = (&self.scene, &self.view, self.targets.size);
        let sky = scene.sky.on_device(scene.emission_scale);
        let uniform = FrameUniform {
            clip_from_world: self.options.depth.clip(view.clip_from_world(self.jitter)).to_cols_array(),
            positions: scene.positions.address(),
            triangles: scene.triangles.address(),
            visibility_triangles: scene.visibility_triangles.address(),
            coplanar: scene.coplanar.address(),
            materials: scene.materials.address(),
            textures: scene.textures.address(),
            texels: scene.texels.address(),
            colours: scene.colours.as_ref().map_or(0, Buffer::address),
            light_vectors: self.mesh.light_vectors.address(),
            normals: scene.normals.as_ref().map_or(0, Buffer::address),
            slots: self.mesh.slots.address(),
            drawn_triangles: self.mesh.drawn_triangles.address(),
            drawn_list: self.drawn_list.address(),
            marks: self.marks.address(),
            lookup_nodes: self.lookup.as_ref().map_or(0, |lookup| lookup.nodes.address()),
            lookup_roots: self.lookup.as_ref().map_or(0, |lookup| lookup.roots.address()),
            list_references: self.list_references.address(),
            mark_references: self.mark_references.address(),
            drawn_pixels: self.counters.address(),
            eye: view.eye.to_array(),
            forward: view.forward.to_array(),
            right: view.right.to_array(),
            down: view.down.to_array(),
            pixel: [2.0 / size.width as f32, 2.0 / size.height as f32],
            jitter: self.jitter.to_array(),
            luminance_scale: self.luminance_scale,
            emission_scale: scene.emission_scale,
            exposure: display.exposure.exp2(),
            emits_back: u32::from(scene.emits_back),
            filter_width: self.filter_width,
            depth_of_inverse: self.options.depth.of_inverse(view.near),
            background_depth: self.options.depth.background(),
            lookup_stamp: self.lookup_stamp,
            sky: sky.entry,
            sky_factor: sky.factor,
            sky_axes: sky.axes,
            sun_direction: sky.sun_direction,
            sun_reach: sky.sun_reach,
            sun_radiance: sky.sun_radiance,
            padding: 0,
        };
        self.uniform.write(0, &[uniform])
    }
}
