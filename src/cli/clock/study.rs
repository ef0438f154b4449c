//! The runs of `bench clock` on a scene.

use super::moves::{Move, Walk};
use super::renders::{Limit, Renders, Timed};
use crate::bench::reference_pixels::{Error as ImageError, ReferencePixels};
use crate::cli::args::SceneArgs;
use crate::cli::args::clock::ClockArgs;
use crate::cli::engine_run::nothing_to_compare;
use crate::cli::progress::say;
use crate::cli::scene;
use crate::cli::values::ClockedScene;
use crate::error::{Error, Result};
use crate::image::exr::read_rgb;
use crate::scene::Scene;
use crate::scene::camera::Camera;
use crate::session::pictures::Picture;
use indicatif::ProgressBar;
use std::sync::Arc;

/// A scene with what errors are measured against.
pub struct Subject {
    /// The scene, its reference and its camera as they were typed.
    pub asked: ClockedScene,
    /// The scene.
    pub scene: Arc<Scene>,
    /// Its camera.
    pub camera: Camera,
    /// Its reference.
    pub reference_pixels: Option<ReferencePixels>,
}

impl Subject {
    /// Reads scene and reference.
    ///
    /// # Errors
    /// What is wrong with either.
    pub fn load(asked: &ClockedScene, args: &ClockArgs) -> Result<Self> {
        let reference_pixels = match &asked.reference {
            Some(path) => Some(ReferencePixels::new(read_rgb(path)?).ok_or_else(|| {
                Error::Usage(format!("{}: no pixel is left to compare, or all are black", path.display()))
            })?),
            None => None,
        };
        let scene_args =
            SceneArgs { path: asked.path.clone(), camera: asked.camera.clone(), size: args.size, up: None };
        let scene = scene::load_and_warn(&scene_args, args.cpu.verbosity)?.scene;
        let camera = scene::camera(&scene, asked.camera.as_deref())?;
        Ok(Self { asked: asked.clone(), scene: Arc::new(scene), camera, reference_pixels })
    }
}

/// All runs on a scene.
pub struct ClockStudy<'a> {
    args: &'a ClockArgs,
    subject: &'a Subject,
    renders: Renders<'a>,
    progress: &'a ProgressBar,
}

/// What the runs on a scene took.
#[derive(Default)]
pub struct Found {
    /// Runs of fixed rays.
    pub whole: Vec<Timed>,
    /// By run, then by time: a run of that time and the error of its image.
    pub timed: Vec<Vec<(Timed, ImageError)>>,
    /// By run, then by move.
    pub walks: Vec<Vec<Move>>,
}

impl<'a> ClockStudy<'a> {
    /// Runs on a scene.
    ///
    /// # Errors
    /// As [`Renders::new`].
    pub fn new(args: &'a ClockArgs, subject: &'a Subject, progress: &'a ProgressBar) -> Result<Self> {
        Ok(Self { args, subject, renders: Renders::new(args)?, progress })
    }

    /// Runs everything, in turns, so that what else the machine does falls on all alike; `None` if it was broken off.
    ///
    /// # Errors
    /// As the runs': no usable device, a lost device, an image that cannot be compared.
    pub fn measure(&self) -> Result<Option<Found>> {
        let mut found = Found::default();
        self.says(0, "building the ray hierarchy");
        let walk = Walk::new(self.args, &self.subject.scene, self.subject.camera)?;
        for run in 0..self.args.runs {
            let Some(whole) = self.whole(run)? else { return Ok(None) };
            found.whole.push(whole);
            if let Some(reference_pixels) = &self.subject.reference_pixels {
                let Some(timed) = self.timed(run, reference_pixels)? else { return Ok(None) };
                found.timed.push(timed);
            }
            let goes_on =
                |picture: &Picture| self.says(run, &format!("walk, picture {} of {}", picture.index + 1, picture.of));
            let Some(moves) = walk.take(self.args, self.args.seed(run), &goes_on)? else { return Ok(None) };
            found.walks.push(moves);
        }
        Ok(Some(found))
    }

    fn whole(&self, run: u64) -> Result<Option<Timed>> {
        self.says(run, &format!("{} rays", self.args.rays));
        self.renders.run(&self.subject.asked, self.args.size, Limit::Rays(self.args.rays), self.args.seed(run))
    }

    /// A run of each time, with its error.
    fn timed(&self, run: u64, reference_pixels: &ReferencePixels) -> Result<Option<Vec<(Timed, ImageError)>>> {
        let mut found = Vec::new();
        let size = reference_pixels.image().size;
        for time in self.args.times() {
            self.says(run, &format!("{} s", time.as_secs_f64()));
            let rendered = self.renders.run(&self.subject.asked, size, Limit::Time(time), self.args.seed(run))?;
            let Some(timed) = rendered else { return Ok(None) };
            let image = read_rgb(&self.renders.image())?;
            found.push((timed, reference_pixels.error(&image.rgb).ok_or_else(nothing_to_compare)?));
        }
        Ok(Some(found))
    }

    /// Says what is going on; whether to go on.
    fn says(&self, run: u64, what: &str) -> bool {
        say(self.progress, &format!("{}, run {} of {}, {what}", self.subject.asked.name(), run + 1, self.args.runs))
    }
}
