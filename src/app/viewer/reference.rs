//! The path-traced reference, in place of the picture or beside it: when it is traced, and when it is shown.

use super::Viewer;
use crate::app::path_traced::{PathTraced, Share, Subject};
use crate::error::Result;
use crate::session::DebugView;
use std::sync::Arc;

impl Viewer {
    /// Whether the reference is shown in place of the picture.
    #[must_use]
    pub const fn shows_reference(&self) -> bool {
        self.shows_reference
    }

    /// Whether the reference is traced: pictures change without the engine.
    #[must_use]
    pub fn is_tracing(&self) -> bool {
        self.reference.as_ref().is_some_and(PathTraced::is_on)
    }

    /// Samples a pixel that the reference has, while it is wanted.
    #[must_use]
    pub fn reference_samples(&self) -> Option<u32> {
        let reference = self.reference.as_ref().filter(|reference| reference.is_on())?;
        Some(reference.progress().map_or(0, |progress| progress.samples))
    }

    /// Has the reference rest while nobody looks; the next frame has it go on.
    pub fn pause_reference(&mut self) {
        self.reference.iter_mut().for_each(PathTraced::rest);
    }

    /// Has the next frame show all anew: it is on another device.
    pub const fn show_anew(&mut self) {
        self.redisplay = true;
    }

    pub(super) fn reference_has_news(&self) -> bool {
        self.reference.as_ref().is_some_and(PathTraced::has_news)
    }

    /// How much of the machine the reference takes, if it is wanted.
    fn share(&self) -> Option<Share> {
        match self.view.debug_view() {
            _ if self.shows_reference => Some(Share::All),
            DebugView::Beside => Some(Share::Quarter),
            _ => None,
        }
    }

    /// Has the reference follow what is looked at, and the session show what is chosen. The frame that comes may be the first of a view:
    /// one in step with frames is traced in those after it.
    pub(super) fn follow_reference(&mut self, first: bool) -> Result<()> {
        let share = self.share();
        self.session.rest(share == Some(Share::All));
        let view = match (share, self.subject()) {
            (Some(share), Some(subject)) => self.trace(subject, share, first)?,
            _ => {
                self.pause_reference();
                None
            }
        };
        let picture = if share == Some(Share::Quarter) { DebugView::Final } else { self.view.debug_view() };
        self.session.set_debug_view(view.unwrap_or(picture));
        Ok(())
    }

    /// What a reference is of now; `None` before there is a hierarchy.
    fn subject(&self) -> Option<Subject> {
        let session = &self.session;
        Some(Subject {
            scene: Arc::clone(session.scene()),
            bvh: Arc::clone(session.hierarchy()?),
            view: *session.view()?,
            lights: self.lights.states(),
        })
    }

    /// Traces the reference, and hands over what is new; the view that shows it, once there is anything to show.
    fn trace(&mut self, subject: Subject, share: Share, first: bool) -> Result<Option<DebugView>> {
        let reference = match self.reference.take() {
            Some(reference) => reference,
            None => PathTraced::new(self.session.options())?,
        };
        let reference = self.reference.insert(reference);
        reference.trace(subject, share);
        let is_new = !first && reference.advance();
        let Some(progress) = reference.progress() else { return Ok(None) };
        if is_new || self.redisplay {
            self.session.set_reference(&progress.picture)?;
        }
        Ok(Some(if share == Share::All { DebugView::Reference } else { DebugView::Beside }))
    }
}
