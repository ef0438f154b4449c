//! The engine's thread: commands in, updates out.

use super::engine::{Budget, Counted, Engine, Visible};
use super::explanation::Explanation;
use super::nice::lower_priority;
use super::probe::PixelQuestion;
use super::right_of_way::RightOfWay;
use super::update::{Question, Shown, Update};
use super::workers::Workers;
use crate::geom::bvh::Bvh;
use crate::scene::light::LightState;
use crossbeam_channel::{Receiver, Sender, TryRecvError, bounded, unbounded};
use std::collections::VecDeque;
use std::sync::{Arc, OnceLock};
use std::thread::JoinHandle;
use std::time::Duration;

/// What the frame loop asks of the engine.
#[derive(Clone, Debug)]
enum Command {
    /// A new view, in which the lights are in these states.
    View(Vec<LightState>, Visible),
    /// One batch of at least this many rays.
    Step(u64),
    /// Everything that waits to be shown.
    Settle,
    /// The same, and then why a pixel is so.
    Explain(PixelQuestion, Sender<Option<Explanation>>),
    /// All that the updates so far add up to.
    Whole,
    /// What the GPU has drawn.
    Counted(Counted),
    /// Slots that show something else.
    Show(Shown),
    /// Something about each drawn triangle.
    Ask(Question),
    /// Whether to do nothing but answer.
    Rest(bool),
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
    frames: Arc<RightOfWay>,
    /// The engine's hierarchy, once that is made.
    made: Arc<OnceLock<Arc<Bvh>>>,
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
        let made = Arc::new(OnceLock::new());
        let is_made = Arc::clone(&made);
        let frames = Arc::new(RightOfWay::default());
        let first_frames = Arc::clone(&frames);
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
            let mut engine = build(workers.giving_way_to(first_frames));
            let Ok(first) = inbox.recv() else { return };
            if let Command::View(_, visible) = &first {
                engine.create_faces(visible);
            }
            complete(&mut engine);
            // It is set once.
            let _ = is_made.set(Arc::clone(engine.hierarchy()));
            run(&mut engine, pace, first, (&inbox, &outbox));
        })?;
        if let Ok(Some(fault)) = told.recv() {
            return Err(fault);
        }
        Ok(Self { commands: Some(commands), updates: Some(updates), thread: Some(thread), frames, made })
    }

    /// By which a frame goes before the engine's work.
    #[must_use]
    pub const fn right_of_way(&self) -> &Arc<RightOfWay> {
        &self.frames
    }

    /// Sends a new view in which the lights are in these states ([`Engine::relight`]). At pace [`Pace::Free`] one that the engine has not
    /// begun when the next comes is not answered. A stopped engine is noticed by [`Self::drain`].
    pub fn relight(&self, lights: Vec<LightState>, visible: Visible) {
        self.send(Command::View(lights, visible));
    }

    /// Asks for one batch of at least `rays` rays (pace [`Pace::Stepped`]); exactly one update answers.
    pub fn step(&self, rays: u64) {
        self.send(Command::Step(rays));
    }

    /// Asks for everything that waits to be shown; the update that has it is marked as [`Update::settled`].
    pub fn settle(&self) {
        self.send(Command::Settle);
    }

    /// Asks for everything that waits to be shown, as [`Self::settle`] does, and why a pixel is so then. The answer comes before the update
    /// that is marked as [`Update::settled`].
    pub fn explain(&self, question: PixelQuestion) -> Receiver<Option<Explanation>> {
        let (tell, told) = bounded(1);
        self.send(Command::Explain(question, tell));
        told
    }

    /// Asks for all that the updates so far add up to; the update that has it is marked as [`Update::whole`].
    pub fn whole(&self) {
        self.send(Command::Whole);
    }

    /// Tells what the GPU has drawn. At pace [`Pace::Stepped`] no update answers.
    pub fn counted(&self, counted: Counted) {
        self.send(Command::Counted(counted));
    }

    /// Has slots show something else ([`Engine::show`]); exactly one update answers, with all of them.
    pub fn show(&self, shown: Shown) {
        self.send(Command::Show(shown));
    }

    /// Asks something of each drawn triangle ([`Engine::ask`]); exactly one update answers.
    pub fn ask(&self, question: Question) {
        self.send(Command::Ask(question));
    }

    /// Has the engine do nothing but answer, until it is told otherwise. At pace [`Pace::Stepped`] it never does more.
    pub fn rest(&self, rests: bool) {
        self.send(Command::Rest(rests));
    }

    /// The hierarchy of the scene, once it is made.
    #[must_use]
    pub fn hierarchy(&self) -> Option<&Arc<Bvh>> {
        self.made.get()
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
        if let Some(thread) = self.thread.take().filter(|_| self.made.get().is_some()) {
            // A panic of the engine has been reported by the panic hook.
            let _ = thread.join();
        }
    }
}

/// Commands that wait, in their order.
struct Queue<'a> {
    inbox: &'a Receiver<Command>,
    waiting: VecDeque<Command>,
    /// Whether of views that wait only the newest is taken: a camera that moves faster than views are answered would leave the engine
    /// ever further behind.
    newest_view: bool,
}

/// Nobody gives commands any more.
struct Abandoned;

impl Queue<'_> {
    /// The next command; if there is none, waits for one or returns nothing.
    fn next(&mut self, waits: bool) -> Result<Option<Command>, Abandoned> {
        if waits && self.waiting.is_empty() {
            self.waiting.push_back(self.inbox.recv().map_err(|_| Abandoned)?);
        }
        loop {
            match self.inbox.try_recv() {
                Ok(command) => self.waiting.push_back(command),
                Err(TryRecvError::Disconnected) if self.waiting.is_empty() => return Err(Abandoned),
                Err(_) => break,
            }
        }
        self.drop_superseded();
        Ok(self.waiting.pop_front())
    }

    fn drop_superseded(&mut self) {
        let views = self.waiting.iter().filter(|command| matches!(command, Command::View(..))).count();
        let mut superseded = if self.newest_view { views.saturating_sub(1) } else { 0 };
        self.waiting.retain(|command| {
            let goes = superseded > 0 && matches!(command, Command::View(..));
            superseded -= usize::from(goes);
            !goes
        });
    }
}

/// Serves commands, from the first on, until their sender is gone; between them, works on (pace free) until nothing is left.
fn run(engine: &mut Engine, pace: Pace, first: Command, (inbox, outbox): (&Receiver<Command>, &Sender<Update>)) {
    let mut queue = Queue { inbox, waiting: VecDeque::from([first]), newest_view: pace != Pace::Stepped };
    let budget = match pace {
        Pace::Free(batch) => Budget::Time(batch),
        Pace::Stepped => Budget::Rays(1),
    };
    // Whether a batch comes before the next command. One between any two, or views and counts that come fast would leave no time for work.
    let mut works_first = false;
    let mut idle = true;
    // Whether it only answers.
    let mut rests = pace == Pace::Stepped;
    loop {
        let command = if std::mem::take(&mut works_first) && !idle { Ok(None) } else { queue.next(idle) };
        let Ok(command) = command else { return };
        let update = match command {
            Some(Command::View(lights, visible)) => {
                works_first = true;
                engine.relight(&lights, &visible)
            }
            Some(Command::Counted(counted)) => {
                engine.counted(&counted);
                idle = rests || engine.is_idle();
                works_first = !counted.pixels.is_empty();
                continue;
            }
            Some(Command::Rest(asked)) => {
                rests = asked || pace == Pace::Stepped;
                idle = rests || engine.is_idle();
                continue;
            }
            Some(Command::Settle) => engine.settle(),
            Some(Command::Explain(question, tell)) => {
                let update = engine.settle();
                // Fails if nobody waits for it any more.
                let _ = tell.send(engine.explain(&question));
                update
            }
            Some(Command::Show(shown)) => engine.show(shown),
            Some(Command::Ask(question)) => engine.ask(question),
            Some(Command::Whole) => engine.whole(),
            Some(Command::Step(rays)) => engine.step(Budget::Rays(rays)),
            None => engine.step(budget),
        };
        idle = rests || engine.is_idle();
        if outbox.send(update).is_err() {
            return;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    fn view(generation: u32) -> Command {
        Command::View(Vec::new(), Visible { generation, eye: Vec3::ZERO, image: None, faces: Vec::new() })
    }

    /// Generations of views, rays of steps and numbers of drawn updates, as they are served.
    fn served(newest_view: bool) -> Vec<u64> {
        let (commands, inbox) = unbounded();
        let counted = Counted { generation: 1, sequence: 70, pixels: Vec::new() };
        let sent = [view(1), Command::Step(50), view(2), Command::Counted(counted), view(3), Command::Step(60)];
        sent.into_iter().for_each(|command| commands.send(command).unwrap());
        drop(commands);
        let mut queue = Queue { inbox: &inbox, waiting: VecDeque::new(), newest_view };
        let number = |command| match command {
            Command::View(_, visible) => visible.generation.into(),
            Command::Step(rays) => rays,
            Command::Counted(counted) => counted.sequence,
            Command::Settle
            | Command::Whole
            | Command::Explain(..)
            | Command::Show(_)
            | Command::Ask(_)
            | Command::Rest(_) => 0,
        };
        std::iter::from_fn(|| queue.next(true).ok().flatten().map(number)).collect()
    }

    #[test]
    fn views_that_a_later_one_supersedes_are_dropped_and_nothing_else_is() {
        assert_eq!(served(true), [50, 70, 3, 60]);
        assert_eq!(served(false), [1, 50, 2, 70, 3, 60]);
    }
}
