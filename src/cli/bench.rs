//! `penombre bench`: the project's own measurements.

use super::args::SceneArgs;
use super::args::bench::{BenchArgs, Study};
use super::progress::{measuring, say};
use super::{Outcome, ablation, clock, convergence, output, scene};
use crate::bench::{Errors, Figure, Hits, Report, measure};
use crate::error::{Error, Result};
use crate::geom::bvh::Bvh;
use crate::light::context::SceneContext;
use crate::light::lights::Lights;
use crate::scene::camera::ImageSize;
use serde::Serialize;
use std::path::PathBuf;

/// The scene that is measured where none is named: the project's own Cornell box.
const DEFAULT_SCENE: &str = "scenes/cornell_box/cornell_box.toml";
/// Image that the path tracer samples once a repetition.
const SIZE: ImageSize = ImageSize { width: 256, height: 192 };

/// What `--json` prints.
#[derive(Serialize)]
struct Document<'a> {
    scene: String,
    triangles: usize,
    lights: usize,
    seed: u64,
    #[serde(flatten)]
    report: &'a Report,
}

/// Runs the command.
///
/// # Errors
/// Bad input, or no default scene where none is named.
pub fn run(args: &BenchArgs) -> Result<Outcome> {
    match &args.study {
        Some(Study::Convergence(args)) => return convergence::run(args),
        Some(Study::Ablate(args)) => return ablation::run(args),
        Some(Study::Clock(args)) => return clock::run(args),
        None => {}
    }
    let scene_args = SceneArgs { path: scene_path(args)?, camera: args.camera.clone(), size: SIZE, up: args.up };
    let loaded = scene::load_and_warn(&scene_args, args.cpu.verbosity)?;
    let camera = scene::camera(&loaded.scene, args.camera.as_deref())?;
    let view = scene::view(&loaded.scene, &camera, &scene_args);
    let pool = args.cpu.pool()?;
    let (bvh, lights) = (Bvh::build(&loaded.scene), Lights::new(&loaded.scene));
    let context = SceneContext::new(&loaded.scene, &bvh, &lights, args.cpu.seed, loaded.scene.scale());
    let progress = measuring(args.cpu.verbosity.quiet);
    let report = measure(&context, &view, &pool, &|what| say(&progress, what));
    progress.finish_and_clear();
    let Some(report) = report else { return Ok(Outcome::Interrupted) };
    let document = Document {
        scene: scene_args.path.display().to_string(),
        triangles: loaded.scene.triangles.len(),
        lights: loaded.scene.lights.len(),
        seed: args.cpu.seed,
        report: &report,
    };
    output::print(&if args.json { json(&document)? } else { table(&document) })?;
    Ok(Outcome::Done)
}

fn scene_path(args: &BenchArgs) -> Result<PathBuf> {
    match &args.scene {
        Some(path) => Ok(path.clone()),
        None if PathBuf::from(DEFAULT_SCENE).is_file() => Ok(PathBuf::from(DEFAULT_SCENE)),
        None => Err(Error::Usage(format!("{DEFAULT_SCENE} is not here; name a SCENE to measure"))),
    }
}

fn json(document: &Document<'_>) -> Result<String> {
    serde_json::to_string_pretty(document).map(|text| text + "\n").map_err(|e| Error::Internal(e.to_string()))
}

/// All figures as text.
fn table(document: &Document<'_>) -> String {
    let Document { scene, triangles, lights, report, .. } = document;
    let rates = &report.rates;
    let mut text = format!("{scene}: {triangles} triangles, {lights} lights\n\n");
    text += "Rays, one thread                          M rays a CPU s    spread\n";
    let mut rate = |name: &str, figure: &Figure| {
        text += &format!("  {name:<38}  {:>12.2}  {:>6.0} %\n", figure.median, figure.spread * 100.0);
    };
    rate("camera, closest hit", &rates.camera);
    rate("scattered, closest hit", &rates.closest);
    if let Some(shadow) = &rates.shadow {
        rate("scattered, shadow", shadow);
    }
    rate("path tracer", &rates.path_tracer);
    rate("path tracer against bare rays", &rates.path_tracer_share);
    text += "\nChoosing directions                             ns a ray    spread\n";
    for cost in &report.choice {
        let Figure { median, spread } = cost.nanoseconds;
        text += &format!("  {:<38}  {median:>12.1}  {:>6.0} %\n", cost.method, spread * 100.0);
    }
    text + &errors(document)
}

/// The errors of the hemisphere methods.
fn errors(document: &Document<'_>) -> String {
    let study = &document.report.hemisphere;
    let mut text = format!(
        "\nIrradiance by hemisphere methods, % of the mean of {} places; truth: {} rays\n  hits    method      allowed    \
         rays    RMSE  expected     bias\n",
        study.points, study.truth_rays
    );
    for row in &study.errors {
        let Errors { method, hits, allowed, rays, rmse, bias, bias_error, expected } = *row;
        let hits = if hits == Hits::Fixed { "fixed" } else { "random" };
        let expected = expected.map_or_else(String::new, |e| format!("{:.2}", e * 100.0));
        let [rmse, bias, bias_error] = [rmse, bias, bias_error].map(|v| v * 100.0);
        text += &format!(
            "  {hits:<6}  {method:<10}  {allowed:>7}  {rays:>6.0}  {rmse:>6.2}  {expected:>8}  {bias:>+7.2} ± {bias_error:.2}\n"
        );
    }
    text
}
