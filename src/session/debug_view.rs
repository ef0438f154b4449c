//! Debug views: which there are, what each needs of engine and renderer, and how far it is there.

use crate::pass::DebugImage;
use crate::refine::update::{Question, Shown};
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
    /// What [`super::Session::set_reference`] was given.
    Reference,
    /// The left half of the picture, and the right half of that.
    Beside,
}

impl DebugView {
    pub(super) const fn image(self) -> Option<DebugImage> {
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
            Self::Reference => DebugImage::Reference,
            Self::Beside => DebugImage::Beside,
        })
    }

    /// What slots must show for it.
    pub(super) const fn shown(self) -> Shown {
        match self {
            Self::Direct(light) => Shown::Direct(light),
            Self::Indirect => Shown::Indirect,
            Self::Knowledge => Shown::Knowledge,
            _ => Shown::Light,
        }
    }

    /// What must be known of each drawn triangle for it.
    pub(super) const fn question(self) -> Option<Question> {
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
    pub wanted: DebugView,
    /// What the engine was last told that slots show.
    pub told: Shown,
    /// What the slots of the renderer show.
    pub shown: Shown,
    /// What was asked last, when, and the view and the rays of that time.
    pub asked: Option<(Question, Instant, (u32, u64))>,
    /// Whether no answer has come yet.
    pub waits: bool,
    /// What the numbers of drawn triangles answer.
    pub answered: Option<Question>,
}

impl Debug {
    /// Whether something that was asked of the engine is still to come.
    pub(super) fn waits(&self) -> bool {
        self.waits || self.told != self.shown || self.told != self.wanted.shown()
    }

    pub(super) fn is_there(&self) -> bool {
        let question = self.wanted.question();
        self.shown == self.wanted.shown() && (question.is_none() || self.answered == question)
    }

    /// The question that is to be asked now, of a view with so many rays; `paced` asks where something changed, however lately it
    /// was asked.
    pub(super) fn question_due(&self, at: (u32, u64), paced: bool) -> Option<Question> {
        let question = self.wanted.question().filter(|_| !self.waits)?;
        let is_old = |(asked, when, then): (Question, Instant, (u32, u64))| {
            asked != question || then != at && (paced || then.0 != at.0 || when.elapsed() >= BETWEEN_QUESTIONS)
        };
        self.asked.is_none_or(is_old).then_some(question)
    }
}
