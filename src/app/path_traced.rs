//! The path-traced reference of what is looked at: on threads of its own beside a window, or in step with the frames of a script.

use crate::error::{Error, Result};
use crate::geom::bvh::Bvh;
use crate::light::context::SceneContext;
use crate::light::lights::Lights;
use crate::reference::{Filter, Progressive, Settings, Strategy, Transport};
use crate::refine::nice::lower_priority;
use crate::scene::Scene;
use crate::scene::camera::View;
use crate::scene::light::LightState;
use crate::session::{Options, Pace, thread_count};
use crossbeam_channel::{Receiver, RecvTimeoutError, Sender, unbounded};
use glam::Vec4;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// What a reference is of.
#[derive(Clone)]
pub struct Subject {
    /// The scene.
    pub scene: Arc<Scene>,
    /// Its hierarchy.
    pub bvh: Arc<Bvh>,
    /// The view.
    pub view: View,
    /// The lights as they are set.
    pub lights: Vec<LightState>,
}

impl PartialEq for Subject {
    /// Scenes differ if they are not one and the same.
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.bvh, &other.bvh) && self.view == other.view && self.lights == other.lights
    }
}

/// How much of the machine a reference takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Share {
    /// All cores.
    All,
    /// A quarter of their time: the light engine works beside it.
    Quarter,
}

/// A reference as it stands.
#[derive(Clone)]
pub struct Progress {
    /// Samples that each pixel has got.
    pub samples: u32,
    /// Radiance, W·sr⁻¹·m⁻², and coverage, by pixel, row by row; empty before there are any.
    pub picture: Vec<Vec4>,
}

/// The reference, of one subject at a time: of the same it goes on where it stopped.
pub struct PathTraced {
    tracing: Tracing,
    /// What is traced, and how; `None` while it rests.
    asked: Option<(Subject, Share)>,
    /// What is known of the subject that was asked for last.
    progress: Option<(Subject, Progress)>,
}

enum Tracing {
    InStep(Box<Tracer>),
    Beside(Thread),
}

impl PathTraced {
    /// A reference that rests; one of a session of fixed work is traced in step with its frames.
    ///
    /// # Errors
    /// [`Error::Exhausted`] if the system gives no threads.
    pub fn new(options: &Options) -> Result<Self> {
        let tracing = match options.pace {
            Pace::Fixed(_) => Tracing::InStep(Box::new(Tracer::new(options, false)?)),
            Pace::Free => Tracing::Beside(Thread::start(Tracer::new(options, true)?)?),
        };
        Ok(Self { tracing, asked: None, progress: None })
    }

    /// Has it traced from now on: of another subject from nothing, of the same on from where it is.
    pub fn trace(&mut self, subject: Subject, share: Share) {
        let asked = Some((subject, share));
        if asked == self.asked {
            return;
        }
        if let (Tracing::Beside(thread), Some(order)) = (&self.tracing, &asked) {
            thread.order(Some(order.clone()));
        }
        self.progress = self.progress.take().filter(|(of, _)| asked.as_ref().is_some_and(|(asked, _)| asked == of));
        self.asked = asked;
    }

    /// Has it rest.
    pub fn rest(&mut self) {
        if self.asked.take().is_some()
            && let Tracing::Beside(thread) = &self.tracing
        {
            thread.order(None);
        }
    }

    /// Whether it is traced.
    #[must_use]
    pub const fn is_on(&self) -> bool {
        self.asked.is_some()
    }

    /// Whether [`Self::advance`] has something new.
    #[must_use]
    pub fn has_news(&self) -> bool {
        match &self.tracing {
            Tracing::InStep(_) => self.is_on(),
            Tracing::Beside(thread) => self.is_on() && thread.has_news(),
        }
    }

    /// Goes on: in step by a sample a pixel, beside by what was done since; whether anything is new.
    pub fn advance(&mut self) -> bool {
        let Some((subject, _)) = &self.asked else { return false };
        let news = match &mut self.tracing {
            Tracing::InStep(tracer) => {
                tracer.take(subject);
                tracer.finish_pass()
            }
            Tracing::Beside(thread) => thread.news().filter(|(of, _)| of == subject),
        };
        let is_new = news.is_some();
        self.progress = news.or_else(|| self.progress.take());
        is_new
    }

    /// What is known of the subject.
    #[must_use]
    pub fn progress(&self) -> Option<&Progress> {
        self.progress.as_ref().filter(|_| self.is_on()).map(|(_, progress)| progress)
    }
}

/// Traces a subject on a pool of threads.
struct Tracer {
    pool: ThreadPool,
    settings: Settings,
    seed: u64,
    of: Option<Traced>,
}

struct Traced {
    subject: Subject,
    lights: Lights,
    scale: f32,
    image: Progressive,
}

impl Tracer {
    /// A tracer of nothing yet. Pixels are sampled at their centres as the picture is, so that both differ in light alone.
    fn new(options: &Options, beside_frames: bool) -> Result<Self> {
        let transport = if options.refinement.indirect { Transport::Full } else { Transport::Direct };
        let settings = Settings { filter: Filter::Point, transport, strategy: Strategy::Both };
        let threads = ThreadPoolBuilder::new().num_threads(thread_count(options.threads));
        let threads = threads.thread_name(|i| format!("penombre-path-{i}")).start_handler(move |_| {
            if beside_frames {
                lower_priority();
            }
        });
        let pool = threads.build().map_err(|e| Error::Exhausted(format!("cannot start threads: {e}")))?;
        Ok(Self { pool, settings, seed: options.seed, of: None })
    }

    /// Takes a subject, if it is another.
    fn take(&mut self, subject: &Subject) {
        if self.of.as_ref().is_some_and(|of| of.subject == *subject) {
            return;
        }
        let before = self.of.take().filter(|of| Arc::ptr_eq(&of.subject.bvh, &subject.bvh));
        let before = before.map(|of| (of.lights, of.scale));
        let (mut lights, scale) = before.unwrap_or_else(|| (Lights::new(&subject.scene), subject.scene.scale()));
        lights.set(&subject.lights);
        self.of = Some(Traced { image: Progressive::new(&subject.view), subject: subject.clone(), lights, scale });
    }

    /// Does a part of a pass; what is known then, unless it was stopped.
    fn advance(&mut self, stop: impl Fn() -> bool + Send + Sync) -> Option<(Subject, Progress)> {
        let Self { pool, settings, seed, of } = self;
        let of = of.as_mut()?;
        let context = SceneContext::new(&of.subject.scene, &of.subject.bvh, &of.lights, *seed, of.scale);
        let is_done = pool.install(|| of.image.advance(&context, *settings, stop));
        is_done.then(|| of.progress())
    }

    /// Does a whole pass.
    fn finish_pass(&mut self) -> Option<(Subject, Progress)> {
        let Self { pool, settings, seed, of } = self;
        let of = of.as_mut()?;
        let context = SceneContext::new(&of.subject.scene, &of.subject.bvh, &of.lights, *seed, of.scale);
        pool.install(|| of.image.finish_pass(&context, *settings));
        Some(of.progress())
    }
}

impl Traced {
    fn progress(&self) -> (Subject, Progress) {
        let progress = Progress { samples: self.image.samples(), picture: self.image.picture().to_vec() };
        (self.subject.clone(), progress)
    }
}

/// What to trace and how, or nothing; with its number.
type Order = (u64, Option<(Subject, Share)>);

/// A tracer on a thread of its own, which ends with this.
struct Thread {
    orders: Option<Sender<Order>>,
    /// Number of the last order: what is done for another is broken off.
    last: Arc<AtomicU64>,
    /// What nobody has taken yet: the newest only.
    news: Arc<Mutex<Option<(Subject, Progress)>>>,
    thread: Option<JoinHandle<()>>,
}

impl Thread {
    fn start(tracer: Tracer) -> Result<Self> {
        let (orders, inbox) = unbounded();
        let (last, news) = (Arc::<AtomicU64>::default(), Arc::<Mutex<_>>::default());
        let work = {
            let (last, news) = (Arc::clone(&last), Arc::clone(&news));
            move || work(tracer, &inbox, &last, &news)
        };
        let thread = std::thread::Builder::new().name("penombre-path".to_owned()).spawn(work);
        let thread = thread.map_err(|e| Error::Exhausted(format!("cannot start a thread: {e}")))?;
        Ok(Self { orders: Some(orders), last, news, thread: Some(thread) })
    }

    /// Gives an order; work for the one before is broken off.
    fn order(&self, order: Option<(Subject, Share)>) {
        let number = self.last.fetch_add(1, Ordering::Relaxed) + 1;
        if let Some(orders) = &self.orders {
            // Fails only if the thread has panicked, which has ended the process.
            let _ = orders.send((number, order));
        }
    }

    fn has_news(&self) -> bool {
        self.news.lock().unwrap_or_else(PoisonError::into_inner).is_some()
    }

    fn news(&self) -> Option<(Subject, Progress)> {
        self.news.lock().unwrap_or_else(PoisonError::into_inner).take()
    }
}

impl Drop for Thread {
    fn drop(&mut self) {
        self.last.fetch_add(1, Ordering::Relaxed);
        self.orders = None;
        if let Some(thread) = self.thread.take() {
            // A panic has been reported by the panic hook.
            let _ = thread.join();
        }
    }
}

/// Traces as the last order says until nobody gives orders any more.
fn work(mut tracer: Tracer, inbox: &Receiver<Order>, last: &AtomicU64, news: &Mutex<Option<(Subject, Progress)>>) {
    lower_priority();
    // How long it rests before the next part, which an order ends; for ever without one.
    let mut pause: Option<Duration> = None;
    let mut order: Order = (0, None);
    loop {
        let arrived = match pause {
            None => inbox.recv().map_err(|_| RecvTimeoutError::Disconnected),
            Some(pause) => inbox.recv_timeout(pause),
        };
        match arrived {
            Ok(arrived) => order = inbox.try_iter().last().unwrap_or(arrived),
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return,
        }
        let (number, Some((subject, share))) = &order else {
            pause = None;
            continue;
        };
        let start = Instant::now();
        tracer.take(subject);
        if let Some(progress) = tracer.advance(|| last.load(Ordering::Relaxed) != *number) {
            *news.lock().unwrap_or_else(PoisonError::into_inner) = Some(progress);
        }
        pause = Some(if *share == Share::Quarter { 3 * start.elapsed() } else { Duration::ZERO });
    }
}
