//! `penombre bench clock`: what a user waits for, by the wall clock and by the process's CPU clock.

mod moves;
mod renders;
mod report;
mod tables;

use self::moves::{Move, Walk};
use self::renders::{Limit, Renders, Timed};
use self::report::{Document, SceneDocument};
use super::args::SceneArgs;
use super::args::clock::ClockArgs;
use super::engine_run::nothing_to_compare;
use super::progress::{measuring, say};
use super::values::ClockedScene;
use super::{Outcome, output, scene};
use crate::bench::reference_pixels::{Error as ImageError, ReferencePixels};
use crate::error::{Error, Result};
use crate::image::atomic;
use crate::image::exr::read_rgb;
use crate::scene::Scene;
use crate::scene::camera::Camera;
use crate::session::pictures::Picture;
use crate::system;
use indicatif::ProgressBar;
use std::sync::Arc;

/// Runs the command.
///
/// # Errors
/// Bad input, no usable device, a lost device, or a plot that cannot be written.
pub fn run(args: &ClockArgs) -> Result<Outcome> {
    args.check()?;
    let subjects = args.scenes.iter().map(|asked| Subject::load(asked, args)).collect::<Result<Vec<_>>>()?;
    let progress = measuring(args.cpu.verbosity.quiet);
    let mut document = Document::new(args, system::load_average());
    for subject in &subjects {
        let study = ClockStudy { args, subject, renders: Renders::new(args)?, progress: &progress };
        let Some(found) = study.measure()? else { return Ok(Outcome::Interrupted) };
        document.add(&found, SceneDocument::new(args, subject, &found));
    }
    progress.finish_and_clear();
    document.load_average_after = system::load_average();
    if let Some(path) = &args.plot {
        atomic::write(path, |file| std::io::Write::write_all(file, document.plot().as_bytes()))?;
    }
    output::print(&if args.json { document.json()? } else { tables::text(&document) })?;
    Ok(Outcome::Done)
}

/// A scene with what errors are measured against.
struct Subject {
    asked: ClockedScene,
    scene: Arc<Scene>,
    camera: Camera,
    reference_pixels: Option<ReferencePixels>,
}

impl Subject {
    fn load(asked: &ClockedScene, args: &ClockArgs) -> Result<Self> {
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
struct ClockStudy<'a> {
    args: &'a ClockArgs,
    subject: &'a Subject,
    renders: Renders<'a>,
    progress: &'a ProgressBar,
}

/// What the runs on a scene took.
#[derive(Default)]
struct Found {
    /// Runs of fixed rays.
    whole: Vec<Timed>,
    /// By run, then by time: a run of that time and the error of its image.
    timed: Vec<Vec<(Timed, ImageError)>>,
    /// By run, then by move.
    walks: Vec<Vec<Move>>,
}

impl ClockStudy<'_> {
    /// Runs everything, in turns, so that what else the machine does falls on all alike; `None` if it was broken off.
    fn measure(&self) -> Result<Option<Found>> {
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
