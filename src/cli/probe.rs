//! `penombre probe`: refines as `render` does, then says why a pixel is so.

use super::args::ProbeArgs;
use super::progress::Progress;
use super::{Outcome, interrupt, output, scene};
use crate::error::{Error, Result};
use crate::refine::update::EngineStats;
use crate::scene::load::Loaded;
use crate::session::{FrameReport, Hierarchy, Observer, Opening, Session};
use std::sync::Arc;
use std::time::Duration;

/// Runs the command.
///
/// # Errors
/// Bad input, a pixel outside of the image, no usable device, or a lost device.
pub fn run(args: &ProbeArgs) -> Result<Outcome> {
    let size = args.scene.size;
    if args.x >= size.width || args.y >= size.height {
        let (x, y) = (args.x, args.y);
        return Err(Error::Usage(format!("{x} {y}: no pixel of an image of {size}; choose another, or --size")));
    }
    let options = args.options();
    let gpu = Opening::start(&options)?;
    let mut hierarchy = None;
    let Loaded { scene, .. } = scene::load_and_warn_beside(&args.scene, args.verbosity, |geometry| {
        hierarchy = Some(Hierarchy::start(geometry));
    })?;
    let hierarchy = hierarchy.ok_or_else(|| Error::Internal("a scene was loaded without triangles".to_owned()))??;
    let camera = scene::camera(&scene, args.scene.camera.as_deref())?;
    let scene = Arc::new(scene);
    let mut session = gpu.finish()?.session(&scene, |scene| hierarchy.finish(scene), &options)?;
    session.look_through(&camera, &[])?;
    let mut watch = Watch(Progress::new(args.verbosity.quiet));
    let by = session.run(&mut watch)?;
    let probe = session.probe([args.x, args.y])?;
    watch.0.finish();
    if let Some(doubt) = session.unfinished(by) {
        output::report(&format!("warning: {doubt}"));
    }
    output::print(&probe.json()?)?;
    Ok(if interrupt::requested() { Outcome::Interrupted } else { Outcome::Done })
}

/// Watches the run: progress line, signals.
struct Watch(Progress);

impl Observer for Watch {
    fn interrupted(&self) -> bool {
        interrupt::requested()
    }

    fn waits(&mut self, elapsed: Duration) {
        self.0.waits(elapsed);
    }

    fn works(&mut self, elapsed: Duration, stats: &EngineStats) {
        self.0.update(elapsed, stats);
    }

    fn frame(&mut self, _: &mut Session, report: &FrameReport) -> Result<()> {
        self.0.update(report.at, &report.engine);
        Ok(())
    }
}
