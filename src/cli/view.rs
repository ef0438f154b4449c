//! `penombre view`: a window to walk through a scene, or a script played without one.

use super::args::ViewArgs;
use super::kept::Kept;
use super::{Outcome, interrupt, numbered, output, scene, trace};
use crate::app::Plan;
use crate::app::headless::{self, Film};
use crate::app::log::Log;
use crate::app::reload::Source;
use crate::app::script::Script;
use crate::app::viewer::Open;
use crate::app::window::{self, Show};
use crate::error::{Error, Result};
use crate::image::atomic;
use crate::log::summary::Summary;
use crate::scene::Display;
use crate::scene::load::Loaded;
use crate::scene::report::Severity;
use crate::session::{Hierarchy, Opening, Options};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

/// Runs the command.
///
/// # Errors
/// Bad input, no window or device, a lost device, or an output that cannot be written.
pub fn run(args: &ViewArgs, start: Instant) -> Result<Outcome> {
    if !args.headless {
        window::check()?;
    }
    let script = args.script.as_deref().map(Script::load).transpose()?.unwrap_or_default();
    check_outputs(args)?;
    trace::traced(args.trace.as_deref(), || view(args, script, start))
}

fn view(args: &ViewArgs, script: Script, start: Instant) -> Result<Outcome> {
    let kept = Kept::open(&args.cache, args.memory.budget(), args.cpu.verbosity.quiet)?;
    let mut hierarchy = None;
    let loading = Instant::now();
    let Loaded { scene, report, files, .. } =
        scene::load_and_warn_beside(&args.scene, args.cpu.verbosity, |geometry| {
            hierarchy = Some(Hierarchy::start(geometry));
        })?;
    let hierarchy = hierarchy.ok_or_else(|| Error::Internal("a scene was loaded without triangles".to_owned()))??;
    script.check(&scene)?;
    let mut summary = Summary::of_this_run();
    summary.times.load = Some(loading.elapsed().as_secs_f64());
    summary.warnings = report.lines(Severity::Warning);
    summary.stand_ins = report.lines(Severity::StandIn);
    summary.origin = scene.origin.to_array();
    let plan = Plan {
        camera: scene::camera(&scene, args.scene.camera.as_deref())?,
        name: args.scene.path.file_stem().map_or_else(|| PathBuf::from("scene"), PathBuf::from),
        open: Open { hud: !args.headless, lights: false, help: false },
        script,
        source: Source { path: args.scene.path.clone(), up: args.scene.up, files },
        log: args.log.as_deref().map(|path| Log::create(path, summary, start)).transpose()?,
        interrupted: interrupt::requested,
    };
    let display = Display {
        exposure: args.exposure.unwrap_or(scene.display.exposure),
        tone_mapping: args.tone_mapping.unwrap_or(scene.display.tone_mapping),
    };
    let options = Options { display: Some(display), store: kept.store(), ..args.options() };
    let scene = Arc::new(scene);
    let written = if args.headless {
        let session = Opening::start(&options)?.finish()?.session(&scene, |scene| hierarchy.finish(scene), &options)?;
        let file = args.output.clone().map(|path| -> Box<dyn Fn(u64) -> PathBuf> {
            Box::new(move |number| numbered::numbered(&path, number + 1))
        });
        headless::play(session, plan, &Film { rate: args.fps, file })?
    } else {
        let title = format!("{} - penombre", plan.name.display());
        window::run(Show { scene, hierarchy, options, vsync: args.vsync, plan, title, give_up })?
    };
    let _ = kept.close();
    if !args.cpu.verbosity.quiet {
        written.iter().for_each(|file| output::report(&format!("recorded {}", file.display())));
    }
    Ok(if interrupt::requested() { Outcome::Interrupted } else { Outcome::Done })
}

/// Ends the process from within a library that would end it otherwise.
fn give_up(error: &Error) -> ! {
    output::error(error);
    atomic::remove_temporaries();
    std::process::exit(error.exit_status().into())
}

/// Checks before any work that frames, log and trace can be written.
fn check_outputs(args: &ViewArgs) -> Result<()> {
    let first = args.output.as_deref().map(|path| numbered::numbered(path, 1));
    let log = args.log.iter().flat_map(|log| [log.clone(), Summary::path_beside(log)]);
    let written: Vec<PathBuf> = first.into_iter().chain(log).chain(args.trace.clone()).collect();
    atomic::check_writable(&written.iter().map(PathBuf::as_path).collect::<Vec<_>>())
}
