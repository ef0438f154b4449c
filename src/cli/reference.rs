//! `penombre reference`: the brute-force yardstick.

use super::args::reference::{PixelFilter, ReferenceArgs};
use super::{Outcome, interrupt, output, scene};
use crate::error::Result;
use crate::geom::bvh::Bvh;
use crate::image::exr::{Provenance, ReferenceLayers, write_reference};
use crate::light::context::SceneContext;
use crate::light::lights::Lights;
use crate::reference::{Accumulator, Filter, Settings, Strategy, Transport, random_pixels};
use crate::scene::Scene;
use crate::scene::camera::View;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::time::{Duration, Instant};

/// Runs the command.
///
/// # Errors
/// Bad input, or an output that cannot be written.
pub fn run(args: &ReferenceArgs) -> Result<Outcome> {
    args.check()?;
    let loaded = scene::load_and_warn(&args.scene, args.cpu.verbosity)?;
    let camera = scene::camera(&loaded.scene, args.scene.camera.as_deref())?;
    let view = scene::view(&loaded.scene, &camera, &args.scene);
    let pool = args.cpu.pool()?;
    let accumulator = pool.install(|| accumulate(args, &loaded.scene, &view));
    let provenance = Provenance { comments: args.image_options(), camera: Some(camera), origin: loaded.scene.origin };
    write(args, &view, &accumulator, &provenance)?;
    Ok(if interrupt::requested() { Outcome::Interrupted } else { Outcome::Done })
}

/// Takes passes until a budget is spent or a signal comes.
fn accumulate(args: &ReferenceArgs, scene: &Scene, view: &View) -> Accumulator {
    let bvh = Bvh::build(scene);
    let lights = Lights::new(scene);
    let context = SceneContext::new(scene, &bvh, &lights, args.cpu.seed, scene.scale());
    let settings = settings(args);
    let mut accumulator = match args.pixels {
        Some(count) => Accumulator::over(view, random_pixels(view.size, count as usize)),
        None => Accumulator::new(view),
    };
    let progress = progress(args);
    let start = Instant::now();
    let mut rays = 0;
    let in_time = |start: Instant| args.time.is_none_or(|limit| start.elapsed() < limit);
    // At least one pass whatever the clock, so that there is an image.
    while accumulator.samples() < args.max_spp() && (accumulator.samples() == 0 || in_time(start)) {
        let pass = accumulator.pass(&context, view, settings, interrupt::requested);
        if !pass.finished {
            break;
        }
        rays += pass.rays;
        progress.set_position(u64::from(accumulator.samples()));
        progress.set_message(message(rays, start.elapsed()));
    }
    progress.finish_and_clear();
    if !args.cpu.verbosity.quiet {
        let spp = accumulator.samples();
        let pixels = args.pixels.map_or_else(String::new, |n| format!(" of {n} among {} pixels", view.size.pixels()));
        output::report(&format!("{spp} samples a pixel{pixels}, {}", message(rays, start.elapsed())));
    }
    accumulator
}

fn settings(args: &ReferenceArgs) -> Settings {
    let filter = match args.filter {
        PixelFilter::Point => Filter::Point,
        PixelFilter::Box => Filter::Box,
    };
    let transport = match (args.direct_only, args.match_method) {
        (true, _) => Transport::Direct,
        (_, true) => Transport::Method,
        _ => Transport::Full,
    };
    Settings { filter, transport, strategy: Strategy::Both }
}

fn message(rays: u64, elapsed: Duration) -> String {
    let seconds = elapsed.as_secs_f64();
    format!("{:.2} M rays/s, {seconds:.1} s", rays as f64 / seconds.max(1e-9) * 1e-6)
}

fn progress(args: &ReferenceArgs) -> ProgressBar {
    if args.cpu.verbosity.quiet {
        return ProgressBar::hidden();
    }
    let length = (args.max_spp() < u32::MAX).then(|| u64::from(args.max_spp()));
    let bar = ProgressBar::with_draw_target(length, ProgressDrawTarget::stderr_with_hz(10));
    let template =
        if length.is_some() { "{pos}/{len} samples a pixel, {msg}, ETA {eta}" } else { "{pos} samples a pixel, {msg}" };
    bar.with_style(ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar()))
}

fn write(args: &ReferenceArgs, view: &View, accumulator: &Accumulator, provenance: &Provenance) -> Result<()> {
    let image = accumulator.image();
    let layers = ReferenceLayers {
        size: view.size,
        mean: &image.mean,
        variance: &image.variance,
        mask: Some(&image.mask),
        sampled: image.sampled.as_deref(),
    };
    let altered = write_reference(&args.output, &layers, provenance)?;
    if let Some(warning) = altered.warning() {
        output::report(&format!("{}: warning: {warning}", args.output.display()));
    }
    Ok(())
}
