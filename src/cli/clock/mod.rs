//! `penombre bench clock`: what a user waits for, by the wall clock and by the process's CPU clock.

mod moves;
mod renders;
mod report;
mod study;
mod tables;

use self::report::{Document, SceneDocument};
use self::study::{ClockStudy, Subject};
use super::args::clock::ClockArgs;
use super::progress::measuring;
use super::{Outcome, output};
use crate::error::Result;
use crate::image::atomic;
use crate::system;

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
        let study = ClockStudy::new(args, subject, &progress)?;
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
