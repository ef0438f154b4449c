//! The command line: arguments and one file a subcommand.

pub mod ablation;
pub mod ablation_report;
pub mod args;
mod bake;
pub mod bench;
mod black_picture;
pub mod clock;
pub mod compare;
pub mod convergence;
pub mod convergence_report;
pub mod diff;
mod engine_run;
pub mod info;
pub mod interrupt;
mod kept;
pub mod numbered;
mod options;
mod outcome;
pub mod output;
pub mod probe;
pub mod progress;
pub mod reference;
pub mod render;
pub mod scene;
mod studio;
mod tilts;
mod trace;
mod values;
pub mod verdict;
pub mod view;

pub use outcome::Outcome;

use crate::error::Result;
use crate::image::atomic;
use args::{Cli, Command};
use clap::Parser;
use std::process::ExitCode;
use std::time::Instant;

/// Parses the command line, runs the command, and prints what went wrong.
#[must_use]
pub fn run() -> ExitCode {
    let start = Instant::now();
    install_panic_hook();
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(answer) => {
            // Help and version go to stdout with status 0. A closed pipe there is no error.
            let _ = answer.print();
            return ExitCode::from(u8::try_from(answer.exit_code()).unwrap_or(2));
        }
    };
    match execute(&cli.command, start) {
        Ok(outcome) => ExitCode::from(outcome.exit_status()),
        Err(error) => {
            output::error(&error);
            ExitCode::from(error.exit_status())
        }
    }
}

fn execute(command: &Command, start: Instant) -> Result<Outcome> {
    interrupt::install()?;
    match command {
        Command::Render(args) => render::run(args, start),
        Command::View(args) => view::run(args, start),
        Command::Probe(args) => probe::run(args),
        Command::Compare(args) => compare::run(args, start),
        Command::Reference(args) => reference::run(args),
        Command::Bake(args) => bake::run(args),
        Command::Diff(args) => diff::run(args),
        Command::Bench(args) => bench::run(args),
        Command::Info(args) => info::run(args),
    }
}

/// Turns a panic on any thread into a message and exit status 70.
///
/// The process ends in the hook: a panic on a worker would otherwise leave the others waiting for it.
pub fn install_panic_hook() {
    std::panic::set_hook(Box::new(|panic| {
        output::report(&format!("internal error: {panic}\nplease report it with the command line and `penombre info`"));
        atomic::remove_temporaries();
        std::process::exit(70);
    }));
}
