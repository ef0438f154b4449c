//! The renderer: passes, images, the scene and the luminance mesh on one device.

use super::colour::Colour;
use super::combine::Combine;
use super::counters::Counters;
use super::debug_view::Debug;
use super::device_array::DeviceArray;
use super::filling::Filling;
use super::frustum::{Frustum, Place};
use super::lookup::Lookup;
use super::luminance::Luminance;
use super::mesh::LuminanceMesh;
use super::needs::Needs;
use super::options::RendererOptions;
use super::pixel_counts::{DrawnCounts, Histogram};
use super::readback::{Layers, LuminanceLayers, ReadBack};
use super::scene_buffers::SceneBuffers;
use super::shared::{FrameUniform, TEXEL_BUFFERS};
use super::targets::Targets;
use super::update::UpdateMode;
use super::visibility::{Visibility, count_pixels};
use crate::error::Result;
use crate::refine::update::{DrawnPixels, Update};
use crate::scene::camera::{Camera, ImageSize, View};
use crate::scene::light::LightState;
use crate::scene::{Display, FaceId, Scene, TriangleId};
use crate::vk::buffer::BufferUse;
use crate::vk::timestamp::PassTimes;
use crate::vk::{Bindings, Buffer, Commands, Device, Image, OcclusionQueries};
use glam::{Vec2, Vec3};
use std::sync::Arc;

/// Queries that a frame may ask for.
const MAX_QUERIES: u32 = 1024;

/// The passes.
pub(super) struct Passes {
    pub visibility: Visibility,
    pub colour: Colour,
    pub luminance: Luminance,
    pub combine: Combine,
}

impl Passes {
    pub(super) fn new(device: &Device, bindings: &Bindings, options: &RendererOptions, needs: Needs) -> Result<Self> {
        let tone_mapping = Display::default().tone_mapping;
        Ok(Self {
            visibility: Visibility::new(device, bindings, options)?,
            colour: Colour::new(device, bindings, options, needs)?,
            luminance: Luminance::new(device, bindings, options, needs)?,
            combine: Combine::new(device, bindings, options, (needs, tone_mapping))?,
        })
    }
}

/// Draws frames of one scene from one camera at a time. Every call returns with the device idle.
pub struct Renderer {
    pub(super) passes: Passes,
    pub(super) targets: Targets,
    pub(super) read_back: ReadBack,
    pub(super) scene: SceneBuffers,
    pub(super) mesh: LuminanceMesh,
    pub(super) drawn_list: DeviceArray<u32>,
    pub(super) marks: DeviceArray<Vec3>,
    pub(super) list_references: DeviceArray<u32>,
    pub(super) mark_references: DeviceArray<u32>,
    pub(super) uniform: Buffer,
    pub(super) bindings: Bindings,
    /// What is shown in place of the picture.
    pub(super) debug: Debug,
    pub(super) commands: Commands,
    pub(super) view: View,
    /// Sub-pixel offset of the samples, pixels.
    pub(super) jitter: Vec2,
    /// Width of the square that textures are filtered over, pixels.
    pub(super) filter_width: f32,
    /// Face of each pixel plus 1 when visibility was last drawn.
    face_ids: Vec<u32>,
    /// Whether each face had pixels when visibility was last drawn.
    pub(super) visible: Vec<bool>,
    /// Where each triangle lay in the view frustum then.
    pub(super) places: Vec<Place>,
    /// Size of the scene, scene units.
    pub(super) extent: f32,
    /// Once faces are filled.
    pub(super) filling: Option<Filling>,
    /// The lights as they are shown.
    lights: Vec<LightState>,
    /// What covered most of the image then.
    pub(super) occluders: Vec<TriangleId>,
    /// Triangles that were drawn for it.
    pub(super) visibility_triangles: u32,
    /// What stored D and S are multiplied by to fit half range.
    pub(super) luminance_scale: f32,
    /// What it was made for.
    pub(super) options: RendererOptions,
    /// What its pipelines can do.
    pub(super) needs: Needs,
    /// The mode whose patches changed the luminance images since all drawn triangles were drawn: the depth that it left serves no
    /// other.
    pub(super) depth_left_by: Option<UpdateMode>,
    /// Where frames look drawn triangles up.
    pub(super) lookup: Option<Lookup>,
    /// Of the drawn triangles that the frame looks up; 0 for all.
    pub(super) lookup_stamp: u32,
    /// What [`RendererOptions::atomic_counts`] counts.
    pub(super) counters: Counters,
    /// Whether depth EQUAL finds what was drawn; by self-test.
    pub(super) stencil_works: bool,
    histogram: Histogram,
    /// Where the device counts exactly.
    pub(super) queries: Option<OcclusionQueries>,
    pub(super) query_counts: Vec<DrawnPixels>,
    /// Passes run since the last frame's statistics.
    pub(super) times: PassTimes,
    /// Last, so that it goes after everything made from it.
    pub(super) device: Arc<Device>,
}

impl Renderer {
    /// A renderer that has drawn nothing, for frames of `size` until it is [resized](Self::resize).
    pub(super) fn cold(device: Arc<Device>, size: ImageSize, options: RendererOptions) -> Result<Self> {
        let mut commands = Commands::new(&device, "frame")?;
        let mut bindings = Bindings::new(&device, "frame", 6, TEXEL_BUFFERS as u32)?;
        let uniform = Buffer::new(&device, "uniform", size_of::<FrameUniform>() as u64, BufferUse::Stream)?;
        let targets = Targets::new(&device, &mut commands, size, options.depth)?;
        bindings.bind_uniform(&uniform);
        bindings.bind_images(&targets.sampled());
        let camera = Camera { position: Vec3::ZERO, look_at: Vec3::NEG_Z, up: Vec3::Y, vertical_fov: 45.0 };
        Ok(Self {
            passes: Passes::new(&device, &bindings, &options, Needs::COMMON)?,
            read_back: ReadBack::new(&device, size.pixels())?,
            scene: SceneBuffers::new(&device, &mut commands, &Scene::default())?,
            mesh: LuminanceMesh::new(&device, false)?,
            drawn_list: DeviceArray::new(&device, "drawn list")?,
            marks: DeviceArray::new(&device, "marks")?,
            view: View::new(&camera, size, 1.0),
            jitter: Vec2::ZERO,
            filter_width: 1.0,
            face_ids: Vec::new(),
            visible: Vec::new(),
            places: Vec::new(),
            extent: 1.0,
            filling: None,
            lights: Vec::new(),
            occluders: Vec::new(),
            visibility_triangles: 0,
            luminance_scale: 1.0,
            depth_left_by: None,
            lookup: None,
            lookup_stamp: 0,
            counters: Counters::new(&device)?,
            list_references: DeviceArray::new(&device, "list references")?,
            mark_references: DeviceArray::new(&device, "mark references")?,
            stencil_works: options.depth.has_stencil(),
            options,
            needs: Needs::COMMON,
            histogram: Histogram::default(),
            queries: OcclusionQueries::new(&device, "patch pixels", MAX_QUERIES)?,
            query_counts: Vec::new(),
            times: PassTimes::default(),
            targets,
            uniform,
            bindings,
            debug: Debug::default(),
            commands,
            device,
        })
    }

    /// The device that it draws on.
    #[must_use]
    pub const fn device(&self) -> &Arc<Device> {
        &self.device
    }

    /// Whether the device redraws triangles at exactly equal depth, as the stencil mode needs; otherwise patches are
    /// drawn by id whatever the options say.
    #[must_use]
    pub const fn stencil_works(&self) -> bool {
        self.stencil_works
    }

    /// Sends a scene, in place of the one before. The luminance mesh starts empty.
    ///
    /// # Errors
    /// [`crate::error::Error::Exhausted`] when memory runs out.
    pub fn load(&mut self, scene: &Scene) -> Result<()> {
        self.scene = SceneBuffers::new(&self.device, &mut self.commands, scene)?;
        self.mesh = LuminanceMesh::new(&self.device, Needs::of(scene).normal_maps)?;
        self.extent = scene.scale();
        self.filling = None;
        self.lights.clear();
        let looks_up = self.options.modes.contains(&UpdateMode::Lookup);
        self.lookup = looks_up.then(|| Lookup::new(&self.device, scene)).transpose()?;
        self.visible.clear();
        self.places.clear();
        self.occluders.clear();
        self.face_ids.clear();
        self.tailor(scene)?;
        self.bind_texel_buffers()
    }

    /// Changes what the area lights show by their states, in the order of the scene's lights. Look the colours up again next.
    ///
    /// # Errors
    /// [`crate::error::Error::DeviceLost`], [`crate::error::Error::Exhausted`] when memory runs out.
    pub fn relight(&mut self, lights: &[LightState]) -> Result<()> {
        if lights == self.lights {
            return Ok(());
        }
        self.filling.iter_mut().for_each(Filling::forget_light);
        self.scene.relight(&self.device, &mut self.commands, lights)?;
        self.lights = lights.to_vec();
        Ok(())
    }

    /// Makes the images of a size. What they showed is gone: draw visibility, colour and all luminance next.
    ///
    /// # Errors
    /// [`crate::error::Error::Exhausted`] when memory runs out, [`crate::error::Error::Usage`] for a size that the device
    /// does not allow. The images stay as they were.
    pub fn resize(&mut self, size: ImageSize) -> Result<()> {
        if size == self.targets.size {
            return Ok(());
        }
        let targets = Targets::new(&self.device, &mut self.commands, size, self.options.depth)?;
        self.read_back = ReadBack::new(&self.device, size.pixels())?;
        self.targets = targets;
        self.bindings.bind_images(&self.targets.sampled());
        self.mesh.require_full();
        self.face_ids.clear();
        self.clear_undrawn_specular()
    }

    /// Moves the camera; `jitter` in pixels, each coordinate in [−½, ½]. Draw visibility, colour and all luminance next.
    pub fn set_view(&mut self, view: &View, jitter: Vec2) {
        self.view = *view;
        self.jitter = jitter;
    }

    /// Sets the width of the square, in pixels, that textures are filtered over: 1 for a picture drawn once, less where
    /// redraws are averaged.
    pub fn set_filter_width(&mut self, pixels: f32) {
        self.filter_width = pixels;
    }

    /// Draws face ids and counts the pixels of each visible face; sorted by face. The frames that follow draw the
    /// drawn triangles of these faces only, so this comes first after every move, a jittered one too.
    ///
    /// # Errors
    /// [`crate::error::Error::DeviceLost`], [`crate::error::Error::Exhausted`] when memory runs out.
    pub fn visibility(&mut self) -> Result<Vec<(FaceId, u32)>> {
        self.send_uniform(None)?;
        let frustum = Frustum::new(&self.view, self.jitter);
        self.draw_visibility(&frustum)?;
        let faces = 2 * self.scene.by_id.len();
        self.face_ids.clear();
        self.face_ids.extend_from_slice(self.read_back.ids()?);
        let counts = count_pixels(&self.face_ids, faces);
        self.places = self.scene.places(&frustum);
        self.visible.clear();
        self.visible.resize(faces, false);
        counts.iter().for_each(|(face, _)| self.visible[face.0 as usize] = true);
        self.choose_occluders(&counts);
        Ok(counts)
    }

    /// Triangles that [`Self::visibility`] last drew, but for those that share a plane; occluders count twice.
    #[must_use]
    pub const fn visibility_triangles(&self) -> u32 {
        self.visibility_triangles
    }

    /// The face of each pixel, plus 1, as [`Self::visibility`] last saw them; 0 where there is none.
    #[must_use]
    pub fn face_ids(&self) -> &[u32] {
        &self.face_ids
    }

    /// Takes changes in; they are drawn by the next frame, or by several if they are many.
    ///
    /// # Errors
    /// [`crate::error::Error::Internal`] for an update that contradicts itself.
    pub fn apply(&mut self, update: &Update) -> Result<()> {
        self.mesh.apply(update)?;
        self.lookup.as_mut().map_or(Ok(()), |lookup| lookup.apply(update, &self.mesh))
    }

    /// Forgets which drawn triangles are drawn (another engine sends its own); their slots stay.
    pub fn reset_drawn(&mut self) {
        self.mesh.reset();
        if let Some(lookup) = &mut self.lookup {
            lookup.reset();
        }
    }

    /// Pixels of each drawn triangle as the luminance images stand.
    ///
    /// # Errors
    /// [`crate::error::Error::DeviceLost`], [`crate::error::Error::Exhausted`] when memory runs out.
    pub fn drawn_counts(&mut self) -> Result<DrawnCounts> {
        let Self { commands, targets, read_back, .. } = self;
        let mut recording = commands.begin()?;
        recording.pass("readback", |pass| read_back.record_drawn_ids(pass, targets));
        let times = recording.submit()?;
        self.times.extend(times);
        Ok(self.histogram.count(self.read_back.ids()?, &self.face_ids, &self.mesh))
    }

    /// What the queries of the last frame counted, in the order drawn: drawn triangles with the pixels that each was drawn to.
    #[must_use]
    pub fn query_counts(&self) -> &[DrawnPixels] {
        &self.query_counts
    }

    /// Drawn triangles of the patches that the last frame drew, with the pixels that each was drawn to; none unless the
    /// renderer was made to count them, or after a frame that drew all drawn triangles.
    #[must_use]
    pub fn atomic_counts(&self) -> &[DrawnPixels] {
        self.counters.last()
    }

    /// Has the next frame draw all drawn triangles: what changes until then need not be kept in order.
    pub fn draw_all_next(&mut self) {
        self.mesh.require_full();
    }

    /// Whether changes wait for the next frame.
    #[must_use]
    pub fn has_pending(&self) -> bool {
        self.mesh.has_pending()
    }

    /// Number of the last update whose triangles are all on the images; new values of some may wait.
    #[must_use]
    pub fn drawn_sequence(&self) -> u64 {
        self.mesh.drawn_sequence()
    }

    /// The image of the displayed picture, for a window: sRGB, A is the coverage. The frames that follow draw into it until the
    /// renderer is resized.
    #[must_use]
    pub const fn display_image(&self) -> &Arc<Image> {
        &self.targets.display
    }

    /// The displayed picture of the last frame that combined: sRGB, A is the coverage.
    ///
    /// # Errors
    /// [`crate::error::Error::DeviceLost`], [`crate::error::Error::Exhausted`] when memory runs out.
    pub fn read_display(&mut self) -> Result<Vec<[u8; 4]>> {
        let Self { commands, targets, read_back, .. } = self;
        let mut recording = commands.begin()?;
        recording.pass("readback", |pass| read_back.record_display(pass, targets));
        let times = recording.submit()?;
        self.times.extend(times);
        self.read_back.display()
    }

    /// The luminance images as they stand.
    ///
    /// # Errors
    /// [`crate::error::Error::DeviceLost`], [`crate::error::Error::Exhausted`] when memory runs out.
    pub fn read_luminance(&mut self) -> Result<LuminanceLayers> {
        let Self { commands, targets, read_back, .. } = self;
        let mut recording = commands.begin()?;
        recording.pass("readback", |pass| read_back.record_luminance(pass, targets));
        let times = recording.submit()?;
        self.times.extend(times);
        self.read_back.luminance(self.luminance_scale)
    }

    /// Everything that the images hold, in linear light and true units.
    ///
    /// # Errors
    /// [`crate::error::Error::DeviceLost`], [`crate::error::Error::Exhausted`] when memory runs out.
    pub fn read_layers(&mut self) -> Result<Layers> {
        self.send_uniform(None)?;
        let Self { commands, passes, bindings, targets, read_back, .. } = self;
        let mut recording = commands.begin()?;
        recording.pass("combine", |pass| passes.combine.record_linear(pass, bindings, targets));
        recording.pass("readback", |pass| read_back.record_layers(pass, targets));
        let times = recording.submit()?;
        self.times.extend(times);
        self.read_back.layers(self.scene.emission_scale, self.luminance_scale)
    }
}
