//! The engine's thread: commands in, updates out.

use super::engine::{Budget, Counted, Engine, Visible};
use super::nice::lower_priority;
use super::update::Update;
use super::workers::Workers;
use crossbeam_channel::{Receiver, Sender, TryRecvError, bounded, unbounded};
use glam::Vec3;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

/// What the frame loop asks of the engine.
#[derive(Clone, Debug)]
enum Command {
    /// A new view.
    View(Visible),
    /// A new view in new light.
    Relight(Vec<Vec3>, Visible),
    /// One batch of at least this many rays.
    Step(u64),
    /// Everything that waits to be shown.
    Settle,
    /// All that the updates so far add up to.
    Whole,
    /// What the GPU has drawn.
    Counted(Counted),
}

/// Whether batches follow the clock or the frame loop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pace {
    /// Batches of about this long, as fast as they come.
    Free(Duration),
    /// One batch of fixed work on each [`EngineThread::step`]: deterministic.
    Stepped,
}

/// Threads of an engine.
#[derive(Clone, Copy, Debug)]
pub struct Crew {
    /// How many, its own included.
    pub threads: usize,
    /// Whether they work beside frames that somebody waits for: at low priority, then.
    pub beside_frames: bool,
}

/// Updates that may wait to be taken: a frame loop that falls further behind makes the engine wait.
const WAITING: usize = 64;

/// A running engine. Dropping it stops the thread after its present batch; one that is still being made is left to
/// itself, and stops when it is.
pub struct EngineThread {
    commands: Option<Sender<Command>>,
    updates: Option<Receiver<Update>>,
    thread: Option<JoinHandle<()>>,
    /// Whether the engine is made.
    made: Arc<AtomicBool>,
}

impl EngineThread {
    /// Starts the thread, which is one of the crew's; `build` makes the engine there with its workers, so that its tables do not
    /// delay the caller, and `complete` gives it what it still waits for, after the faces of the first view are created.
    ///
    /// # Errors
    /// If the system gives no threads.
    pub fn spawn(
        pace: Pace,
        Crew { threads, beside_frames }: Crew,
        build: impl FnOnce(Workers) -> Engine + Send + 'static,
        complete: impl FnOnce(&mut Engine) + Send + 'static,
    ) -> std::io::Result<Self> {
        let (commands, inbox) = unbounded();
        let (outbox, updates) = bounded(WAITING);
        let made = Arc::new(AtomicBool::new(false));
        let is_made = Arc::clone(&made);
        let (tell, told) = bounded(1);
        let thread = std::thread::Builder::new().name("penombre-engine".to_owned()).spawn(move || {
            if beside_frames {
                lower_priority();
            }
            let workers = Workers::with_this_thread(threads, beside_frames).map_err(std::io::Error::other);
            let (workers, fault) = workers.map_or_else(|fault| (None, Some(fault)), |workers| (Some(workers), None));
            // Fails if nobody waits for it.
            let _ = tell.send(fault);
            let Some(workers) = workers else { return };
            let mut engine = build(workers);
            let Ok(first) = inbox.recv() else { return };
            if let Command::View(visible) | Command::Relight(_, visible) = &first {
                engine.create_faces(visible);
            }
            complete(&mut engine);
            is_made.store(true, Ordering::Release);
            run(&mut engine, pace, first, (&inbox, &outbox));
        })?;
        if let Ok(Some(fault)) = told.recv() {
            return Err(fault);
        }
        Ok(Self { commands: Some(commands), updates: Some(updates), thread: Some(thread), made })
    }

    /// Sends a new view. A stopped engine is noticed by [`Self::drain`].
    pub fn set_visible(&self, visible: Visible) {
        self.send(Command::View(visible));
    }

    /// Sends a new view in which the lights emit `factors` times what the scene says ([`Engine::relight`]).
    pub fn relight(&self, factors: Vec<Vec3>, visible: Visible) {
        self.send(Command::Relight(factors, visible));
    }

    /// Asks for one batch of at least `rays` rays (pace [`Pace::Stepped`]); exactly one update answers.
    pub fn step(&self, rays: u64) {
        self.send(Command::Step(rays));
    }

    /// Asks for everything that waits to be shown; the update that has it is marked as [`Update::settled`].
    pub fn settle(&self) {
        self.send(Command::Settle);
    }

    /// Asks for all that the updates so far add up to; the update that has it is marked as [`Update::whole`].
    pub fn whole(&self) {
        self.send(Command::Whole);
    }

    /// Tells what the GPU has drawn. At pace [`Pace::Stepped`] no update answers.
    pub fn counted(&self, counted: Counted) {
        self.send(Command::Counted(counted));
    }

    fn send(&self, command: Command) {
        if let Some(commands) = &self.commands {
            // Fails only if the thread is gone, which the next `drain` or `wait` reports.
            let _ = commands.send(command);
        }
    }

    /// The updates that have arrived, without waiting; `None` if the engine has died.
    #[must_use]
    pub fn drain(&self) -> Option<Vec<Update>> {
        let inbox = self.updates.as_ref()?;
        let mut updates = Vec::new();
        loop {
            match inbox.try_recv() {
                Ok(update) => updates.push(update),
                Err(TryRecvError::Empty) => return Some(updates),
                Err(TryRecvError::Disconnected) => return None,
            }
        }
    }

    /// The next update, waiting for it; `None` if the engine has died.
    #[must_use]
    pub fn wait(&self) -> Option<Update> {
        self.updates.as_ref()?.recv().ok()
    }

    /// The next update if one arrives within `timeout`.
    #[must_use]
    pub fn wait_for(&self, timeout: Duration) -> Option<Update> {
        self.updates.as_ref()?.recv_timeout(timeout).ok()
    }
}

impl Drop for EngineThread {
    fn drop(&mut self) {
        // Both ends: the engine may be waiting to hand an update over.
        self.commands = None;
        self.updates = None;
        if let Some(thread) = self.thread.take().filter(|_| self.made.load(Ordering::Acquire)) {
            // A panic of the engine has been reported by the panic hook.
            let _ = thread.join();
        }
    }
}

/// Serves commands, from the first on, until their sender is gone; between them, works on (pace free) until nothing is left.
fn run(engine: &mut Engine, pace: Pace, first: Command, (inbox, outbox): (&Receiver<Command>, &Sender<Update>)) {
    let (mut idle, mut first) = (true, Some(first));
    let budget = match pace {
        Pace::Free(batch) => Budget::Time(batch),
        Pace::Stepped => Budget::Rays(1),
    };
    loop {
        let command = if first.is_some() {
            first.take()
        } else if idle {
            match inbox.recv() {
                Ok(command) => Some(command),
                Err(_) => return,
            }
        } else {
            match inbox.try_recv() {
                Ok(command) => Some(command),
                Err(TryRecvError::Empty) => None,
                Err(TryRecvError::Disconnected) => return,
            }
        };
        let update = match command {
            Some(Command::View(visible)) => engine.set_visible(&visible),
            Some(Command::Relight(factors, visible)) => engine.relight(&factors, &visible),
            Some(Command::Counted(counted)) => {
                engine.counted(&counted);
                idle = pace == Pace::Stepped || engine.is_idle();
                if idle || counted.pixels.is_empty() {
                    continue;
                }
                // A batch between any two counts, or counts that come fast would leave no time for work.
                engine.step(budget)
            }
            Some(Command::Settle) => engine.settle(),
            Some(Command::Whole) => engine.whole(),
            Some(Command::Step(rays)) => engine.step(Budget::Rays(rays)),
            None => engine.step(budget),
        };
        idle = pace == Pace::Stepped || engine.is_idle();
        if outbox.send(update).is_err() {
            return;
        }
    }
}
