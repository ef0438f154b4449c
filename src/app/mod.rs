//! The window: walk through a scene while its light converges.
//!
//! Everything that can be done is a [`command::Command`] of one [`table`]: keys and mouse ([`controls`]), [`panels`] and [`script`]s all come
//! down to these, and the [`viewer::Viewer`] does them. The viewer draws with a session and knows neither window nor clock, so
//! that [`headless`] plays the same as [`stage`], the thread that draws for a [`window`]. The window's own thread only passes on what
//! happens to it.

pub mod arguments;
pub mod command;
pub mod controls;
pub mod explained;
pub mod flight;
pub mod headless;
pub mod history;
pub mod libraries;
pub mod lights;
pub mod log;
pub mod lost_display;
pub mod panels;
pub mod path_traced;
pub mod pick;
pub mod probe_panel;
pub mod rate;
pub mod recording;
pub mod recovery;
pub mod reload;
pub mod screen;
pub mod script;
#[cfg(feature = "shader-reload")]
pub mod shader_watch;
pub mod shots;
pub mod stage;
pub mod table;
pub mod trigger;
pub mod viewer;
pub mod views;
pub mod window;
pub mod words;

use crate::error::Result;
use crate::scene::camera::Camera;
use crate::session::{FrameReport, Observer, Session};
use log::Log;
use reload::Source;
use script::Script;
use std::path::PathBuf;
use viewer::Open;

/// What is to be done, with a window or without.
pub struct Plan {
    /// Where the camera is at first.
    pub camera: Camera,
    /// What pictures without a name of their own are called, but for number and extension.
    pub name: PathBuf,
    /// Which panels are open at first.
    pub open: Open,
    /// Commands with their times; empty without a script.
    pub script: Script,
    /// Where the scene is loaded from.
    pub source: Source,
    /// The frame log, if one is written.
    pub log: Option<Log>,
    /// Whether the user has asked for an end from outside.
    pub interrupted: fn() -> bool,
}

impl Observer for Plan {
    fn interrupted(&self) -> bool {
        (self.interrupted)()
    }

    fn frame(&mut self, session: &mut Session, report: &FrameReport) -> Result<()> {
        self.log.as_mut().map_or(Ok(()), |log| log.frame(session, report))
    }
}

impl Plan {
    /// Writes what is written in the end: the summary beside the log.
    ///
    /// # Errors
    /// [`crate::error::Error::Io`] naming the file.
    pub fn finish(&mut self, session: &Session) -> Result<()> {
        self.log.take().map_or(Ok(()), |log| log.finish(session))
    }
}

/// The lines of the help: each command with its arguments, what it does, and what stands for it.
#[must_use]
pub fn help() -> String {
    let line = |entry: &table::Entry| {
        let keys = trigger::labels(entry.triggers, &|_| None);
        let keys = if keys.is_empty() { String::new() } else { format!(" [{keys}]") };
        format!("  {}{keys}\n      {}\n", entry.usage(), entry.help)
    };
    table::ENTRIES.iter().map(line).collect()
}
