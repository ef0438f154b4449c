//! `penombre bake`: the lit mesh of all faces, without a device.

use super::args::bake::BakeArgs;
use super::progress::Progress;
use super::{Outcome, interrupt, output, scene};
use crate::bake::baker::Baker;
use crate::bake::lit_mesh::LitMesh;
use crate::bake::{glb, ply};
use crate::error::{Error, Result};
use crate::geom::bvh::Bvh;
use crate::refine::engine::Budget;
use crate::refine::update::EngineStats;
use crate::refine::workers::Workers;
use crate::session::{EndedBy, Spent, thread_count};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Work between two looks at clock and signals, where a time is asked for, and where not: the same whatever the clock.
const STEP_TIME: Duration = Duration::from_millis(50);
const STEP_RAYS: u64 = 50_000;

/// Runs the command.
///
/// # Errors
/// Bad input, or an output that cannot be written.
pub fn run(args: &BakeArgs) -> Result<Outcome> {
    args.check()?;
    let plan = args.plan();
    let loaded = scene::load_bare(&args.path, args.up, args.cpu.verbosity)?;
    let display = args.display(&loaded.scene.display);
    plan.check(&loaded.scene)?;
    let scene = Arc::new(loaded.scene);
    let bvh = Arc::new(Bvh::build(&scene));
    let threads = thread_count(args.cpu.threads);
    let workers = Workers::new(threads, false).map_err(|e| Error::Exhausted(format!("cannot start threads: {e}")))?;
    let picture = args.picture();
    let by_pixels = args.refinement.shadow_size.is_none().then_some(picture.refinement.thresholds.shadow_pixels);
    let options = plan.engine_options(&scene, picture.engine_options(&scene), by_pixels);
    let mut baker = Baker::new(Arc::clone(&scene), bvh, workers, options, plan)?;
    let progress = Progress::new(args.cpu.verbosity.quiet);
    let start = Instant::now();
    let (stats, by) = refine(&mut baker, args, &progress, start)?;
    let mesh = baker.lit_mesh()?;
    progress.finish();
    say(args, &mesh, &stats, by, start);
    for path in &args.output.paths {
        if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("ply")) {
            ply::write(path, &mesh, &display)?;
        } else {
            glb::write(path, &scene, &mesh, args.output.scale)?;
        }
    }
    Ok(if interrupt::requested() { Outcome::Interrupted } else { Outcome::Done })
}

/// Refines until a limit is reached or a signal comes.
fn refine(baker: &mut Baker, args: &BakeArgs, progress: &Progress, start: Instant) -> Result<(EngineStats, EndedBy)> {
    let limits = args.limits();
    let mut rays = 0;
    loop {
        let budget = match limits.time {
            Some(_) => Budget::Time(STEP_TIME),
            None => Budget::Rays(limits.rays.map_or(STEP_RAYS, |most| STEP_RAYS.min(most.saturating_sub(rays)))),
        };
        let stats = baker.step(budget)?;
        rays = stats.rays;
        progress.update(start.elapsed(), &stats);
        let spent =
            Spent { time: start.elapsed(), frames: 0, rays, error: stats.estimated_error, converged: stats.converged };
        if let Some(by) = interrupt::requested().then_some(EndedBy::Interrupted).or_else(|| limits.ended_by(&spent)) {
            return Ok((stats, by));
        }
    }
}

/// Says what the mesh is, and what of it is a guess.
fn say(args: &BakeArgs, mesh: &LitMesh, stats: &EngineStats, by: EndedBy, start: Instant) {
    let LitMesh { filled: [filled, all], .. } = mesh;
    if !stats.complete {
        let unlit = stats.unlit;
        output::report(&format!(
            "warning: the run ended ({}) before light was looked for at {unlit} vertices: theirs is taken from around; give it more time",
            by.name()
        ));
    } else if filled * 2 > *all {
        let why = "other geometry covers them, or they see no light";
        output::report(&format!("warning: the light of {filled} of {all} vertices is taken from around: {why}"));
    }
    if !args.cpu.verbosity.quiet {
        let error = stats.estimated_error.map_or_else(String::new, |e| format!(", error {:.2} %", e * 100.0));
        output::report(&format!(
            "{} vertices, {} triangles, {:.1} s, {:.2} M rays{error} ({})",
            mesh.vertex_count(),
            mesh.triangle_count(),
            start.elapsed().as_secs_f64(),
            stats.rays as f64 * 1e-6,
            by.name()
        ));
    }
    if args.cpu.verbosity.verbose {
        output::report(&format!("{filled} of {all} vertices are covered: their light is taken from around"));
    }
}
