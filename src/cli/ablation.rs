//! `penombre bench ablate`: the error of the light engine without each of its pieces against that with all of them.

use super::ablation_report::{Document, Row, SceneDocument};
use super::args::SceneArgs;
use super::args::ablate::AblateArgs;
use super::engine_run::{Measuring, combined, follow, nothing_to_compare};
use super::progress::{measuring, say};
use super::values::AblatedScene;
use super::{Outcome, output, scene};
use crate::bench::ablation::{Measured, after_rays};
use crate::bench::reference_pixels::ReferencePixels;
use crate::error::{Error, Result};
use crate::geom::bvh::Bvh;
use crate::image::exr::read_rgb;
use crate::pass::Renderer;
use crate::refine::options::Piece;
use crate::refine::update::EngineStats;
use crate::scene::Scene;
use crate::scene::camera::View;
use crate::session::{Observer, Opening, Options, Refinement, Session, owned_engine};
use indicatif::ProgressBar;
use std::sync::Arc;

/// Runs the command.
///
/// # Errors
/// Bad input, no usable device, or a lost device.
pub fn run(args: &AblateArgs) -> Result<Outcome> {
    let subjects = args.scenes.iter().map(|asked| Subject::load(asked, args)).collect::<Result<Vec<_>>>()?;
    let Some(first) = subjects.first() else { return Ok(Outcome::Done) };
    let mut renderer = Opening::start(&args.options(first.reference_pixels.image().size))?.finish()?.renderer;
    let progress = measuring(args.cpu.verbosity.quiet);
    let mut document = Document::new(args, &renderer.device().report().name);
    for subject in &subjects {
        let mut ablation = Ablation::new(args, subject, renderer)?;
        let Some(found) = ablation.measure(&progress)? else { return Ok(Outcome::Interrupted) };
        renderer = ablation.into_renderer()?;
        document.scenes.push(found);
    }
    progress.finish_and_clear();
    output::print(&if args.json { document.json()? } else { document.text() })?;
    Ok(Outcome::Done)
}

/// A scene, as its reference sees it.
struct Subject {
    asked: AblatedScene,
    scene: Arc<Scene>,
    view: View,
    reference_pixels: ReferencePixels,
}

impl Subject {
    fn load(asked: &AblatedScene, args: &AblateArgs) -> Result<Self> {
        let reference = read_rgb(&asked.reference)?;
        let size = reference.size;
        let reference_pixels = ReferencePixels::new(reference).ok_or_else(|| {
            Error::Usage(format!("{}: no pixel is left to compare, or all are black", asked.reference.display()))
        })?;
        let scene_args = SceneArgs { path: asked.path.clone(), camera: asked.camera.clone(), size, up: None };
        let scene = scene::load_and_warn(&scene_args, args.cpu.verbosity)?.scene;
        let camera = scene::camera(&scene, asked.camera.as_deref())?;
        let view = scene::view(&scene, &camera, &scene_args);
        Ok(Self { asked: asked.clone(), scene: Arc::new(scene), view, reference_pixels })
    }

    /// What it is called in messages and tables.
    fn name(&self) -> String {
        let camera = self.asked.camera.as_ref().map_or_else(String::new, |camera| format!("@{camera}"));
        self.asked.path.display().to_string() + &camera
    }
}

/// The runs on one scene.
struct Ablation<'a> {
    args: &'a AblateArgs,
    subject: &'a Subject,
    bvh: Arc<Bvh>,
    options: Options,
    /// In between runs.
    renderer: Option<Renderer>,
}

/// What is refined in a run, and errors found by seed, then by number of rays.
struct Setting {
    refinement: Refinement,
    found: Vec<Vec<Measured>>,
}

impl<'a> Ablation<'a> {
    fn new(args: &'a AblateArgs, subject: &'a Subject, mut renderer: Renderer) -> Result<Self> {
        let options = args.options(subject.reference_pixels.image().size);
        renderer.load(&subject.scene)?;
        renderer.resize(options.size)?;
        let bvh = Arc::new(Bvh::build(&subject.scene));
        Ok(Self { args, subject, bvh, options, renderer: Some(renderer) })
    }

    fn into_renderer(self) -> Result<Renderer> {
        self.renderer.ok_or_else(lost_renderer)
    }

    /// Runs everything; `None` if it was broken off.
    fn measure(&mut self, progress: &ProgressBar) -> Result<Option<SceneDocument>> {
        let base = self.options.refinement;
        let pairs: Vec<[Refinement; 2]> = self.args.pieces().into_iter().map(|piece| pair(base, piece)).collect();
        let mut settings: Vec<Setting> = Vec::new();
        for &refinement in [base].iter().chain(pairs.as_flattened()) {
            if settings.iter().all(|setting| setting.refinement != refinement) {
                settings.push(Setting { refinement, found: Vec::new() });
            }
        }
        let runs = self.args.seeds as usize * settings.len();
        for (number, (seed, setting)) in runs_of(self.args.seeds, settings.len()).enumerate() {
            let what = format!("{}, run {} of {runs}", self.subject.name(), number + 1);
            let Some(found) = self.run(settings[setting].refinement, seed, (&what, progress))? else {
                return Ok(None);
            };
            settings[setting].found.push(found);
        }
        let found = |refinement: Refinement| {
            let setting = settings.iter().find(|setting| setting.refinement == refinement);
            setting.map_or(&[][..], |setting| setting.found.as_slice())
        };
        let of_pair = |(piece, [with, without]): (Piece, [Refinement; 2])| Row {
            piece: piece.name(),
            with: found(with).to_vec(),
            without: found(without).to_vec(),
        };
        let rows = self.args.pieces().into_iter().zip(pairs).map(of_pair).collect();
        let Subject { asked, scene, reference_pixels, .. } = self.subject;
        let name = self.subject.name();
        let tables = self.args.rays();
        Ok(Some(SceneDocument::new((name, asked), scene, reference_pixels, tables, found(base), rows)))
    }

    /// Errors of one run at the asked numbers of rays; `None` if it was broken off.
    fn run(
        &mut self,
        refinement: Refinement,
        seed: u64,
        (what, progress): (&str, &ProgressBar),
    ) -> Result<Option<Vec<Measured>>> {
        let options = Options { seed: self.options.seed.wrapping_add(seed), refinement, ..self.options.clone() };
        let Subject { scene, view, reference_pixels, .. } = self.subject;
        let engine = owned_engine(scene, &self.bvh, &options)?;
        let mut renderer = self.renderer.take().ok_or_else(lost_renderer)?;
        renderer.reset_drawn();
        let mut session = Session::new(renderer, engine, scene, &options);
        session.look(view, &[])?;
        let rays = self.args.rays();
        let mut errors = Errors { reference_pixels, rays: &rays, trim: self.args.trim, points: Vec::new() };
        let goes_on = |stats: &EngineStats| say(progress, &format!("{what}, {:.2} M rays", stats.rays as f64 * 1e-6));
        let is_whole = follow(&mut session, &mut errors, &goes_on)?;
        self.renderer = Some(session.into_renderer());
        Ok(is_whole.then(|| errors.after_rays()))
    }
}

/// Seed by seed, so that what an early end leaves is whole.
fn runs_of(seeds: u64, settings: usize) -> impl Iterator<Item = (u64, usize)> {
    (0..seeds).flat_map(move |seed| (0..settings).map(move |setting| (seed, setting)))
}

/// What is refined with a piece and without it.
fn pair(base: Refinement, piece: Piece) -> [Refinement; 2] {
    if piece == Piece::Filter {
        return [true, false].map(|filter| Refinement { filter, ..base });
    }
    [base, Refinement { without: base.without.with(piece), ..base }]
}

fn lost_renderer() -> Error {
    Error::Internal("a run has kept the renderer".to_owned())
}

/// Errors of a run about the asked numbers of rays.
struct Errors<'a> {
    reference_pixels: &'a ReferencePixels,
    /// Rising.
    rays: &'a [u64],
    trim: f64,
    points: Vec<Measured>,
}

/// Share of an asked number of rays from which on frames are measured: a frame adds a sixteenth, or a little more, so that one comes
/// before.
const ABOUT: f64 = 0.85;

impl Observer for Errors<'_> {
    fn wants_picture(&mut self, stats: &EngineStats) -> bool {
        let last = self.points.last().map_or(0, |point| point.rays);
        let next = self.rays.iter().find(|&&rays| rays > last);
        stats.rays > 0 && (next.is_some_and(|&next| stats.rays as f64 >= ABOUT * next as f64) || self.is_last(stats))
    }
}

impl Measuring for Errors<'_> {
    fn measure(&mut self, session: &mut Session, stats: &EngineStats) -> Result<()> {
        let image = combined(session)?;
        let found = Measured::new(self.reference_pixels, &image, stats.rays, self.trim);
        self.points.push(found.ok_or_else(nothing_to_compare)?);
        Ok(())
    }

    fn is_last(&self, stats: &EngineStats) -> bool {
        stats.converged || self.rays.last().is_none_or(|&last| stats.rays >= last)
    }
}

impl Errors<'_> {
    fn after_rays(&self) -> Vec<Measured> {
        self.rays.iter().filter_map(|&rays| after_rays(&self.points, rays)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_filter_is_measured_against_a_run_with_it() {
        let base = Refinement { filter: false, ..Refinement::default() };
        let [with, without] = pair(base, Piece::Filter);
        assert_eq!((with, without), (Refinement { filter: true, ..base }, base));
        let [with, without] = pair(base, Piece::Checks);
        assert_eq!(with, base);
        assert!(without.without.has(Piece::Checks) && !without.filter);
    }
}
