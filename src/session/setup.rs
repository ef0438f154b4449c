//! What a run starts from: device, hierarchy and light engine, each set up on a thread of its own.

use super::Session;
use super::light_engine::{LightEngine, Pace};
use super::options::{Frames, Moves, Options, thread_count};
use crate::error::{Error, Result};
use crate::geom::bvh::Bvh;
use crate::geom::tree::{Primitives, Tree};
use crate::pass::Renderer;
use crate::refine::engine::Engine;
use crate::refine::memory::Memory;
use crate::refine::thread::{Crew, EngineThread, Pace as ThreadPace};
use crate::refine::workers::Workers;
use crate::scene::Scene;
use crate::scene::content::Content;
use crate::scene::geometry::{Geometry, repeats};
use crate::store::Store;
use crate::store::page_file::PageFile;
use crate::trace::{self, within};
use crate::vk::{Device, DeviceOptions};
use std::sync::{Arc, OnceLock};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

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
    /// Opens the device that the options name on a thread of its own, for images of their size.
    ///
    /// # Errors
    /// [`Error::Exhausted`] if the system gives no thread.
    pub fn start(options: &Options) -> Result<Self> {
        let options = options.clone();
        let thread = spawn("penombre-gpu-setup", move || {
            let start = Instant::now();
            let wanted = DeviceOptions { device: options.device.clone(), validation: None };
            let device = within("open device", || Device::new(&wanted))?;
            Gpu::new(device, start.elapsed(), &options)
        })?;
        Ok(Self(Some(thread)))
    }

    /// Waits for it.
    ///
    /// # Errors
    /// No usable device, or no memory for the images.
    pub fn finish(mut self) -> Result<Gpu> {
        let thread = self.0.take().ok_or_else(|| Error::Internal("the GPU is opened once".to_owned()))?;
        thread.join().map_err(|_| Error::Internal("a set-up thread panicked".to_owned()))?
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

impl Gpu {
    /// The passes on a device that took so long to open.
    ///
    /// # Errors
    /// [`Error::NoDevice`] if it lacks the depth format, [`Error::Exhausted`] when memory runs out.
    pub fn new(device: Arc<Device>, opened_in: Duration, options: &Options) -> Result<Self> {
        let _pipelines = trace::span("pipelines");
        let start = Instant::now();
        let made_for = options.renderer_options(&device)?;
        let renderer = Renderer::with_options(device, options.size, made_for)?;
        let device_seconds = opened_in.as_secs_f64();
        Ok(Self { renderer, device_seconds, pipeline_seconds: start.elapsed().as_secs_f64() })
    }

    /// A session of a scene; its engine waits on a thread of its own for the hierarchy.
    ///
    /// # Errors
    /// [`Error::Exhausted`] when memory or threads run out, [`Error::DeviceLost`].
    pub fn session(
        self,
        scene: &Arc<Scene>,
        hierarchy: impl FnOnce(&Scene) -> Arc<Bvh> + Send + 'static,
        options: &Options,
    ) -> Result<Session> {
        let mut renderer = self.renderer;
        within("send scene", || renderer.load(scene))?;
        renderer.resize(options.size)?;
        let frames = options.frames_on(renderer.device());
        let engine = LightEngine::Thread(engine_thread(scene, hierarchy, options, frames)?);
        Ok(Session::new(renderer, engine, scene, options))
    }
}

impl Session {
    /// Opens the device and builds hierarchy and engine in parallel. The first step waits for what is not done by then.
    ///
    /// # Errors
    /// [`Error::NoDevice`] without a usable device, [`Error::Exhausted`] when memory or threads run out.
    pub fn open(scene: &Arc<Scene>, options: &Options) -> Result<Self> {
        let opening = Opening::start(options)?;
        let hierarchy = Hierarchy::start(&scene.geometry(&repeats(&scene.triangles)))?;
        opening.finish()?.session(scene, |scene| hierarchy.finish(scene), options)
    }
}

/// A hierarchy in the making.
pub struct Hierarchy {
    thread: JoinHandle<(Tree, Duration)>,
    /// Seconds that it took, once it is there.
    pub seconds: Arc<OnceLock<f64>>,
}

impl Hierarchy {
    /// Builds the hierarchy of triangles on a thread of its own.
    ///
    /// # Errors
    /// [`Error::Exhausted`] if the system gives no thread.
    pub fn start(geometry: &Geometry) -> Result<Self> {
        let start = Instant::now();
        let primitives = Primitives::of(geometry);
        let thread = spawn("penombre-bvh", move || {
            let tree = within("hierarchy", || primitives.build());
            (tree, start.elapsed())
        })?;
        Ok(Self { thread, seconds: Arc::default() })
    }

    /// Waits for it; `scene` is that of the triangles.
    #[must_use]
    pub fn finish(self, scene: &Scene) -> Arc<Bvh> {
        // A panic of the builder has ended the process in the panic hook; an empty tree never gets used.
        let Ok((tree, spent)) = self.thread.join() else { return Arc::new(Bvh::build(&Scene::default())) };
        let start = Instant::now();
        let bvh = within("collapse hierarchy", || Bvh::new(tree, scene));
        let _ = self.seconds.set((spent + start.elapsed()).as_secs_f64());
        Arc::new(bvh)
    }
}

/// Length of a batch at a free pace: short against the time between frames, long against the cost of handing an update over.
const BATCH: Duration = Duration::from_millis(4);
const BATCH_OF_SELDOM_FRAMES: Duration = Duration::from_millis(20);

/// How long a view waits for new faces, and for S, where moves are drawn at once: all of the moonlit library's take ten times as long.
const VIEW: Duration = Duration::from_millis(8);

/// Starts an engine; its thread waits for the hierarchy.
pub(super) fn engine_thread(
    scene: &Arc<Scene>,
    hierarchy: impl FnOnce(&Scene) -> Arc<Bvh> + Send + 'static,
    options: &Options,
    frames: Frames,
) -> Result<EngineThread> {
    let beside_frames = options.pace == Pace::Free && frames != Frames::Seldom;
    let crew = Crew { threads: thread_count(options.threads), beside_frames };
    let pace = match options.pace {
        Pace::Free if beside_frames => ThreadPace::Free(BATCH),
        Pace::Free => ThreadPace::Free(BATCH_OF_SELDOM_FRAMES),
        Pace::Fixed(_) => ThreadPace::Stepped,
    };
    let draws_at_once = options.moves == Moves::AtOnce && options.pace == Pace::Free;
    let is_watched = beside_frames || options.moves == Moves::AtOnce;
    let memory = options.memory.map(limited);
    let keeping = options.store.as_ref().map(|store| Keeping::start(store, scene)).transpose()?;
    let (scene, options) = (Arc::clone(scene), options.engine_options(scene));
    let build = move |workers| {
        let mut engine = Engine::without_hierarchy(scene, workers, options);
        if let Some(memory) = memory {
            engine.limit_memory(memory);
        }
        if is_watched {
            engine.smooth_frames();
        }
        if draws_at_once {
            engine.answer_views_within(VIEW);
        }
        engine
    };
    let complete = move |engine: &mut Engine| {
        engine.take_hierarchy(hierarchy);
        keeping.into_iter().for_each(|keeping| keeping.finish(engine));
    };
    EngineThread::spawn(pace, crew, build, complete).map_err(|e| no_threads(&e))
}

/// A memory budget, with a file for what does not fit in.
fn limited(bytes: u64) -> Memory {
    let file = PageFile::create(&PageFile::usual_folder());
    Memory::limited(usize::try_from(bytes).unwrap_or(usize::MAX), file)
}

/// An engine that runs in the caller's thread; the pace is the session's.
///
/// # Errors
/// [`Error::Exhausted`] if the system gives no threads.
pub fn owned_engine(scene: &Arc<Scene>, bvh: &Arc<Bvh>, options: &Options) -> Result<LightEngine> {
    let workers = Workers::new(thread_count(options.threads), false).map_err(|e| no_threads(&e))?;
    let mut engine = Engine::new(Arc::clone(scene), Arc::clone(bvh), workers, options.engine_options(scene));
    if let Some(store) = &options.store {
        Keeping::start(store, scene)?.finish(&mut engine);
    }
    Ok(LightEngine::owned(engine))
}

/// What is needed of a scene to keep its light, in the making.
struct Keeping {
    store: Arc<Store>,
    content: JoinHandle<Content>,
}

impl Keeping {
    /// Looks at a scene on a thread of its own.
    fn start(store: &Arc<Store>, scene: &Arc<Scene>) -> Result<Self> {
        let of = Arc::clone(scene);
        let content = spawn("penombre-content", move || within("content of the scene", || Content::of(&of)))?;
        Ok(Self { store: Arc::clone(store), content })
    }

    /// Waits for it and has an engine keep its light.
    fn finish(self, engine: &mut Engine) {
        // A panic has ended the process in the panic hook.
        if let Ok(content) = self.content.join() {
            engine.keep_in(self.store, &content);
        }
    }
}

fn no_threads(fault: &dyn std::fmt::Display) -> Error {
    Error::Exhausted(format!("cannot start threads: {fault}"))
}

fn spawn<T: Send + 'static>(name: &str, work: impl FnOnce() -> T + Send + 'static) -> Result<JoinHandle<T>> {
    let spawned = std::thread::Builder::new().name(name.to_owned()).spawn(work);
    spawned.map_err(|e| Error::Exhausted(format!("cannot start a thread: {e}")))
}
