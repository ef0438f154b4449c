//! Debug views: which there are, what each needs of engine and renderer, and when it is there to be shown.

use super::Session;
use crate::error::Result;
use crate::pass::{DebugImage, FrameOptions};
use crate::refine::update::{Question, Shown, Update};
use std::time::{Duration, Instant};

/// What is shown of a view. Lights are named by their number in the scene.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum DebugView {
    /// The picture.
    #[default]
    Final,
    /// k_d.
    Kd,
    /// k_s.
    Ks,
    /// L_e.
    Emission,
    /// D.
    Diffuse,
    /// S.
    Specular,
    /// D of the direct light of one light.
    Direct(u32),
    /// D of indirect light.
    Indirect,
    /// A colour for each face.
    Faces,
    /// Splits above the drawn triangles.
    Level,
    /// The estimated error of each drawn triangle.
    Error,
    /// Where values are missing, guessed, or not to be had.
    Knowledge,
    /// The drawn triangles.
    Mesh,
    /// The mesh at whose vertices one light was sampled.
    LightMesh(u32),
}

impl DebugView {
    const fn image(self) -> Option<DebugImage> {
        Some(match self {
            Self::Final => return None,
            Self::Kd => DebugImage::Kd,
            Self::Ks => DebugImage::Ks,
            Self::Emission => DebugImage::Emission,
            Self::Diffuse | Self::Direct(_) | Self::Indirect => DebugImage::Diffuse,
            Self::Specular => DebugImage::Specular,
            Self::Faces => DebugImage::Faces,
            Self::Level => DebugImage::Level,
            Self::Error => DebugImage::Error,
            Self::Knowledge => DebugImage::Knowledge,
            Self::Mesh => DebugImage::Mesh,
            Self::LightMesh(_) => DebugImage::LightMesh,
        })
    }

    /// What slots must show for it.
    const fn shown(self) -> Shown {
        match self {
            Self::Direct(light) => Shown::Direct(light),
            Self::Indirect => Shown::Indirect,
            Self::Knowledge => Shown::Knowledge,
            _ => Shown::Light,
        }
    }

    /// What must be known of each drawn triangle for it.
    const fn question(self) -> Option<Question> {
        match self {
            Self::Error => Some(Question::Error),
            Self::LightMesh(light) => Some(Question::LightMesh(light)),
            _ => None,
        }
    }
}

/// Time between two questions while light changes: an answer goes through all leaves in view.
const BETWEEN_QUESTIONS: Duration = Duration::from_millis(250);

/// The debug view that is wanted, and how far it is there.
#[derive(Debug, Default)]
pub(super) struct Debug {
    wanted: DebugView,
    /// What the engine was last told that slots show.
    told: Shown,
    /// What the slots of the renderer show.
    shown: Shown,
    /// What was asked last, when, and the view and the rays of that time.
    asked: Option<(Question, Instant, (u32, u64))>,
    /// Whether no answer has come yet.
    waits: bool,
    /// What the numbers of drawn triangles answer.
    answered: Option<Question>,
}

impl Debug {
    /// Whether something that was asked of the engine is still to come.
    pub(super) fn waits(&self) -> bool {
        self.waits || self.told != self.shown || self.told != self.wanted.shown()
    }

    fn is_there(&self) -> bool {
        let question = self.wanted.question();
        self.shown == self.wanted.shown() && (question.is_none() || self.answered == question)
    }

    /// The question that is to be asked now, of a view with so many rays; `paced` asks where something changed, however lately it
    /// was asked.
    fn question_due(&self, at: (u32, u64), paced: bool) -> Option<Question> {
        let question = self.wanted.question().filter(|_| !self.waits)?;
        let is_old = |(asked, when, then): (Question, Instant, (u32, u64))| {
            asked != question || then != at && (paced || then.0 != at.0 || when.elapsed() >= BETWEEN_QUESTIONS)
        };
        self.asked.is_none_or(is_old).then_some(question)
    }
}

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
