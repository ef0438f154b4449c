//! The light engine as a session drives it: on a thread of its own, or owned and run between frames.

use crate::error::{Error, Result};
use crate::geom::bvh::Bvh;
use crate::refine::engine::{Budget, Counted, Engine, Visible};
use crate::refine::explanation::Explanation;
use crate::refine::probe::PixelQuestion;
use crate::refine::thread::EngineThread;
use crate::refine::update::{Question, Shown, Update};
use crate::scene::light::LightState;
use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Duration;

/// How much work the engine does between two frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pace {
    /// As much as it comes to, beside the frames.
    Free,
    /// Batches of fixed work, the frames wait for them: the same seed gives the same frames.
    Fixed(Batches),
}

/// Fixed work of the engine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Batches {
    /// Rays of a batch, at least.
    pub rays: u64,
    /// Rays between two frames at most: more batches come between them as the rays so far grow.
    pub most: u64,
    /// Frames between a count of pixels and the engine hearing of it.
    pub counts_lag: usize,
}

impl Batches {
    /// One batch a frame, heard of as late as by a device that draws two frames ahead: `render --deterministic`.
    pub const A_FRAME: Self = Self { rays: 20_000, most: 20_000, counts_lag: 2 };

    /// More come between two frames when a frame's would add less than this share of the rays so far.
    const GROWTH: u64 = 16;

    /// Batches until the next frame, when so many rays are traced.
    #[must_use]
    pub fn until_next_frame(&self, rays: u64) -> u64 {
        (rays / Self::GROWTH).clamp(self.rays, self.most) / self.rays
    }
}

/// A light engine, wherever it runs.
pub enum LightEngine {
    /// On a thread of its own, free or stepped.
    Thread(EngineThread),
    /// In the caller's thread: it works when it is stepped.
    Owned(Box<OwnedEngine>),
}

/// An engine with the updates that it has answered.
pub struct OwnedEngine {
    engine: Engine,
    updates: VecDeque<Update>,
}

impl LightEngine {
    /// An engine that runs in the caller's thread.
    #[must_use]
    pub fn owned(engine: Engine) -> Self {
        Self::Owned(Box::new(OwnedEngine { engine, updates: VecDeque::new() }))
    }

    /// Sends a new view in which the lights are in these states, in the order of the scene's; those that are not given are as loaded.
    pub fn relight(&mut self, lights: Vec<LightState>, visible: Visible) {
        match self {
            Self::Thread(thread) => thread.relight(lights, visible),
            Self::Owned(owned) => {
                let update = owned.engine.relight(&lights, &visible);
                owned.updates.push_back(update);
            }
        }
    }

    /// Asks for one batch of at least `rays` rays; exactly one update answers. Not for a thread at a free pace.
    pub fn step(&mut self, rays: u64) {
        match self {
            Self::Thread(thread) => thread.step(rays),
            Self::Owned(owned) => {
                let update = owned.engine.step(Budget::Rays(rays));
                owned.updates.push_back(update);
            }
        }
    }

    /// Everything that waited to be shown: the updates up to the one that has it.
    ///
    /// # Errors
    /// [`Error::Internal`] if the engine has stopped.
    pub fn settle(&mut self) -> Result<Vec<Update>> {
        match self {
            Self::Thread(thread) => thread.settle(),
            Self::Owned(owned) => {
                let update = owned.engine.settle();
                owned.updates.push_back(update);
            }
        }
        self.until_settled()
    }

    /// Settles, as [`Self::settle`] does, and explains a pixel in that state; `None` if its face never was in view.
    ///
    /// # Errors
    /// [`Error::Internal`] if the engine has stopped.
    pub fn explain(&mut self, question: PixelQuestion) -> Result<(Vec<Update>, Option<Explanation>)> {
        match self {
            Self::Thread(thread) => {
                let answer = thread.explain(question);
                // First, since the engine may be waiting to hand an update over.
                let updates = self.until_settled()?;
                Ok((updates, answer.recv().map_err(|_| stopped())?))
            }
            Self::Owned(owned) => {
                let update = owned.engine.settle();
                let answer = owned.engine.explain(&question);
                owned.updates.push_back(update);
                Ok((self.until_settled()?, answer))
            }
        }
    }

    fn until_settled(&mut self) -> Result<Vec<Update>> {
        let mut updates = Vec::new();
        while updates.last().is_none_or(|update: &Update| !update.settled) {
            updates.push(self.wait()?);
        }
        Ok(updates)
    }

    /// Has slots show something else; exactly one update answers, with all of them.
    pub fn show(&mut self, shown: Shown) {
        match self {
            Self::Thread(thread) => thread.show(shown),
            Self::Owned(owned) => {
                let update = owned.engine.show(shown);
                owned.updates.push_back(update);
            }
        }
    }

    /// Asks something of each drawn triangle; exactly one update answers.
    pub fn ask(&mut self, question: Question) {
        match self {
            Self::Thread(thread) => thread.ask(question),
            Self::Owned(owned) => {
                let update = owned.engine.ask(question);
                owned.updates.push_back(update);
            }
        }
    }

    /// All that the updates so far add up to; those on their way are part of it.
    ///
    /// # Errors
    /// [`Error::Internal`] if the engine has stopped.
    pub fn whole(&mut self) -> Result<Update> {
        match self {
            Self::Thread(thread) => thread.whole(),
            Self::Owned(owned) => {
                let update = owned.engine.whole();
                owned.updates.push_back(update);
            }
        }
        loop {
            let update = self.wait()?;
            if update.whole {
                return Ok(update);
            }
        }
    }

    /// Tells what the GPU has drawn.
    pub fn counted(&mut self, counted: Counted) {
        match self {
            Self::Thread(thread) => thread.counted(counted),
            Self::Owned(owned) => owned.engine.counted(&counted),
        }
    }

    /// The next update, waiting for it.
    ///
    /// # Errors
    /// [`Error::Internal`] if the engine has stopped, or an owned one was not asked for anything.
    pub fn wait(&mut self) -> Result<Update> {
        let update = match self {
            Self::Thread(thread) => thread.wait(),
            Self::Owned(owned) => owned.updates.pop_front(),
        };
        update.ok_or_else(stopped)
    }

    /// The next update if one arrives within `timeout`.
    pub fn wait_for(&mut self, timeout: Duration) -> Option<Update> {
        match self {
            Self::Thread(thread) => thread.wait_for(timeout),
            Self::Owned(owned) => owned.updates.pop_front(),
        }
    }

    /// The updates that have arrived, without waiting.
    ///
    /// # Errors
    /// [`Error::Internal`] if the engine has stopped.
    pub fn arrived(&mut self) -> Result<Vec<Update>> {
        match self {
            Self::Thread(thread) => thread.drain().ok_or_else(stopped),
            Self::Owned(owned) => Ok(owned.updates.drain(..).collect()),
        }
    }

    /// Has an engine on a thread do nothing but answer, until it is told otherwise; an owned one never does more.
    pub fn rest(&self, rests: bool) {
        if let Self::Thread(thread) = self {
            thread.rest(rests);
        }
    }

    /// The hierarchy of the scene, once it is made.
    #[must_use]
    pub fn hierarchy(&self) -> Option<&Arc<Bvh>> {
        match self {
            Self::Thread(thread) => thread.hierarchy(),
            Self::Owned(owned) => Some(owned.engine.hierarchy()),
        }
    }

    /// Whether an owned engine has nothing to do until it hears more; of one on a thread only its updates tell.
    #[must_use]
    pub fn is_idle(&self) -> Option<bool> {
        match self {
            Self::Thread(_) => None,
            Self::Owned(owned) => Some(owned.engine.is_idle()),
        }
    }
}

fn stopped() -> Error {
    Error::Internal("the light engine has stopped".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn batches_grow_with_the_rays_so_far_up_to_the_most() {
        let growing = Batches { rays: 20_000, most: 400_000, counts_lag: 0 };
        let batches = [0, 320_000, 639_999, 640_000, 6_400_000, u64::MAX].map(|rays| growing.until_next_frame(rays));
        assert_eq!(batches, [1, 1, 1, 2, 20, 20]);
        assert_eq!([0, u64::MAX].map(|rays| Batches::A_FRAME.until_next_frame(rays)), [1, 1]);
    }
}
