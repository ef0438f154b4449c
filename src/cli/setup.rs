//! What a run with a GPU starts from: device, hierarchy and light engine, each set up on a thread of its own, and the faces that a
//! view shows.

use super::args::{DeviceArgs, EngineArgs, RefinementArgs, thread_count};
use crate::error::{Error, Result};
use crate::geom::bvh::Bvh;
use crate::image::film;
use crate::pass::{Renderer, RendererOptions};
use crate::refine::engine::Engine;
use crate::refine::options::Options;
use crate::refine::thread::{EngineThread, Pace};
use crate::refine::workers::Workers;
use crate::scene::camera::{ImageSize, View};
use crate::scene::{Display, FaceId, Scene};
use crate::vk::{Device, DeviceOptions};
use glam::Vec2;
use std::sync::{Arc, OnceLock};
use std::thread::JoinHandle;
use std::time::Instant;

/// The GPU side, opened while the scene loads.
pub struct Gpu {
    /// The passes of a frame.
    pub renderer: Renderer,
    /// Seconds that opening the device took.
    pub device_seconds: f64,
    /// Seconds that building the pipelines took.
    pub pipeline_seconds: f64,
}

/// The GPU side in the making. Whoever leaves early waits for it: a driver whose set-up is cut off by the end of the process may
/// crash it.
pub struct Opening(Option<JoinHandle<Result<Gpu>>>);

impl Opening {
    /// Waits for it.
    ///
    /// # Errors
    /// No usable device, or no memory for the images.
    pub fn finish(mut self) -> Result<Gpu> {
        let thread = self.0.take().ok_or_else(|| Error::Internal("the GPU is opened once".to_owned()))?;
        join(thread)?
    }
}

impl Drop for Opening {
    fn drop(&mut self) {
        if let Some(thread) = self.0.take() {
            // What went wrong there does not matter any more.
            let _ = thread.join();
        }
    }
}

/// Opens the device on a thread of its own, for images of this size and what the options say.
///
/// # Errors
/// The system gives no thread.
pub fn open_gpu(
    device: &DeviceArgs,
    size: ImageSize,
    renderer_options: impl FnOnce(&Device) -> Result<RendererOptions> + Send + 'static,
) -> Result<Opening> {
    let options = DeviceOptions { device: device.device.clone(), validation: None };
    let thread = spawn("penombre-gpu-setup", move || {
        let start = Instant::now();
        let device = Device::new(&options)?;
        let device_seconds = start.elapsed().as_secs_f64();
        let made_for = renderer_options(&device)?;
        let renderer = Renderer::with_options(device, size, made_for)?;
        let pipeline_seconds = start.elapsed().as_secs_f64() - device_seconds;
        Ok(Gpu { renderer, device_seconds, pipeline_seconds })
    })?;
    Ok(Opening(Some(thread)))
}

/// A hierarchy in the making.
pub struct Hierarchy {
    thread: JoinHandle<Bvh>,
    /// Seconds that it took, once it is there.
    pub seconds: Arc<OnceLock<f64>>,
}

impl Hierarchy {
    /// Waits for it.
    #[must_use]
    pub fn finish(self) -> Arc<Bvh> {
        // A panic of the builder has ended the process in the panic hook; an empty tree never gets used.
        Arc::new(self.thread.join().unwrap_or_else(|_| Bvh::build(&Scene::default())))
    }
}

/// Builds the hierarchy of a scene on a thread of its own.
///
/// # Errors
/// The system gives no thread.
pub fn build_hierarchy(scene: &Arc<Scene>) -> Result<Hierarchy> {
    let seconds = Arc::new(OnceLock::new());
    let (scene, done) = (Arc::clone(scene), Arc::clone(&seconds));
    let thread = spawn("penombre-bvh", move || {
        let start = Instant::now();
        let bvh = Bvh::build(&scene);
        let _ = done.set(start.elapsed().as_secs_f64());
        bvh
    })?;
    Ok(Hierarchy { thread, seconds })
}

/// What the light engine is set up with.
#[derive(Clone, Copy, Debug)]
pub struct EngineSetup {
    /// Image size.
    pub size: ImageSize,
    /// How images are displayed.
    pub display: Display,
    /// Threads, seed, pace.
    pub engine: EngineArgs,
    /// What is refined.
    pub refinement: RefinementArgs,
    /// Whether indirect light that is shown is filtered.
    pub filter: bool,
    /// Whether the pixels of all triangles are counted.
    pub counted: bool,
}

impl EngineSetup {
    /// Starts the engine; its thread waits for the hierarchy.
    ///
    /// # Errors
    /// The system gives no threads.
    pub fn start(
        &self,
        scene: &Arc<Scene>,
        hierarchy: impl FnOnce() -> Arc<Bvh> + Send + 'static,
    ) -> Result<EngineThread> {
        let no_threads = |e: &dyn std::fmt::Display| Error::Exhausted(format!("cannot start threads: {e}"));
        let workers = Workers::new(thread_count(self.engine.threads)).map_err(|e| no_threads(&e))?;
        let pace = if self.engine.deterministic { Pace::Stepped } else { Pace::Free };
        let (scene, options) = (Arc::clone(scene), self.options(scene));
        EngineThread::spawn(pace, move || Engine::new(scene, hierarchy(), workers, options)).map_err(|e| no_threads(&e))
    }

    fn options(&self, scene: &Scene) -> Options {
        let Self { size, display, engine, refinement, filter, counted } = *self;
        let image = size.width.max(size.height) as f32;
        Options {
            seed: engine.seed,
            indirect: !refinement.direct_only,
            filter,
            counted,
            hemisphere: refinement.hemisphere,
            max_light_groups: refinement.max_light_groups as usize,
            priority: refinement.priority,
            min_pixels: refinement.min_pixels,
            contrast: refinement.contrast,
            // What covers a few pixels where the whole scene fills the image; nearer to the eye, what does so there.
            shadow_size: refinement.shadow_size.unwrap_or(scene.scale() * SHADOW_PIXELS / image),
            shadow_pixels: refinement.shadow_size.map_or(SHADOW_AREA, |_| f32::INFINITY),
            white: (-display.exposure).exp2(),
            tolerance: TOLERANCE,
        }
    }
}

/// Default size of the smallest shadow wanted, pixels.
pub(super) const SHADOW_PIXELS: f32 = 12.0;
/// Default pixels of the largest leaf that may hide a shadow: half a square of that size.
pub(super) const SHADOW_AREA: f32 = SHADOW_PIXELS * SHADOW_PIXELS / 2.0;
/// Error of a pixel against the image's mean at which refinement ends.
pub(super) const TOLERANCE: f32 = 2.5e-4;

fn spawn<T: Send + 'static>(name: &str, work: impl FnOnce() -> T + Send + 'static) -> Result<JoinHandle<T>> {
    let spawned = std::thread::Builder::new().name(name.to_owned()).spawn(work);
    spawned.map_err(|e| Error::Exhausted(format!("cannot start a thread: {e}")))
}

fn join<T>(thread: JoinHandle<T>) -> Result<T> {
    thread.join().map_err(|_| Error::Internal("a set-up thread panicked".to_owned()))
}

/// Finds what the camera sees: the union over the jitters of the written image, pixels averaged.
///
/// # Errors
/// The device is lost or memory runs out.
pub fn visible_faces(renderer: &mut Renderer, view: &View, aa: u32) -> Result<Vec<(FaceId, u32)>> {
    let offsets = film::jitter(aa);
    let mut all: Vec<(FaceId, u32)> = Vec::new();
    for &offset in offsets.iter().rev() {
        renderer.set_view(view, offset);
        all.extend(renderer.visibility()?);
    }
    if aa > 1 {
        renderer.set_view(view, Vec2::ZERO);
        all.extend(renderer.visibility()?);
    }
    all.sort_unstable();
    let mut merged: Vec<(FaceId, u32)> = Vec::with_capacity(all.len());
    for (face, pixels) in all {
        match merged.last_mut() {
            Some((last, sum)) if *last == face => *sum += pixels,
            _ => merged.push((face, pixels)),
        }
    }
    let redraws = if aa > 1 { aa + 1 } else { 1 };
    merged.iter_mut().for_each(|(_, pixels)| *pixels = pixels.div_ceil(redraws));
    Ok(merged)
}
