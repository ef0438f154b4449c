//! Debug views of a run: the engine is asked for what one needs, and it is shown once that is there.

use super::Session;
use super::debug_view::DebugView;
use crate::error::Result;
use crate::pass::FrameOptions;
use crate::refine::update::{Shown, Update};
use std::time::Instant;

impl Session {
    /// Shows a debug view, as soon as the engine has told what it needs; frames show the one before until then.
    pub fn set_debug_view(&mut self, view: DebugView) {
        self.redisplay |= view != self.debug.wanted;
        self.debug.wanted = view;
    }

    /// The debug view that is wanted.
    #[must_use]
    pub const fn debug_view(&self) -> DebugView {
        self.debug.wanted
    }

    /// Whether frames show the debug view that is wanted.
    #[must_use]
    pub fn shows_debug_view(&self) -> bool {
        self.debug.is_there() && self.renderer.debug_image() == self.debug.wanted.image()
    }

    /// Asks the engine for what the debug view needs, and has the renderer show it once that is there; the updates that were waited for.
    pub(super) fn prepare_debug_view(&mut self) -> Result<Vec<Update>> {
        let mut updates = Vec::new();
        let paced = self.batches().is_some();
        let shown = self.debug.wanted.shown();
        if std::mem::replace(&mut self.debug.told, shown) != shown {
            self.engine.show(shown);
            updates.extend(self.answer()?);
        }
        let at = (self.wanted, self.stats.rays);
        if let Some(question) = self.debug.question_due(at, paced) {
            self.engine.ask(question);
            (self.debug.asked, self.debug.waits) = (Some((question, Instant::now(), at)), true);
            updates.extend(self.answer()?);
        }
        if self.debug.wanted == DebugView::Level {
            self.renderer.set_debug_values(self.levels.all().map(|(drawn, level)| (drawn, level.into())))?;
            self.debug.answered = None;
        }
        if self.debug.is_there() {
            self.renderer.set_debug_image(self.debug.wanted.image());
        } else if self.debug.shown == Shown::Light && self.debug.told != Shown::Light {
            self.renderer.set_debug_image(None);
        }
        Ok(updates)
    }

    /// The answer of an engine that works in step with the frames; one that is free answers when it comes to it.
    fn answer(&mut self) -> Result<Option<Update>> {
        if self.batches().is_none() {
            return Ok(None);
        }
        let update = self.engine.wait()?;
        self.apply(std::slice::from_ref(&update))?;
        Ok(Some(update))
    }

    /// Takes in what an update says for debug views.
    pub(super) fn hear_for_debug_view(&mut self, update: &Update) -> Result<()> {
        if std::mem::replace(&mut self.debug.shown, update.shown) != update.shown {
            // All values change at once.
            self.renderer.draw_all_next();
            self.redisplay = true;
        }
        let Some(answer) = &update.answer else { return Ok(()) };
        (self.debug.answered, self.debug.waits, self.redisplay) = (Some(answer.question), false, true);
        self.renderer.set_debug_values(answer.of.iter().copied())
    }

    /// Has the images hold light again, for files; the next frame goes back to the debug view.
    pub(super) fn draw_light(&mut self) -> Result<()> {
        if self.debug.told == Shown::Light && self.debug.shown == Shown::Light {
            return Ok(());
        }
        self.debug.told = Shown::Light;
        self.engine.show(Shown::Light);
        let updates = self.engine.settle()?;
        self.apply(&updates)?;
        self.renderer.set_debug_image(None);
        self.renderer.frame(&FrameOptions { full_luminance: true, ..FrameOptions::default() })?;
        self.redisplay = true;
        Ok(())
    }
}
