//! `penombre render` as a user runs it: a process of its own, timed from outside.

use crate::cli::args::clock::ClockArgs;
use crate::cli::interrupt;
use crate::cli::values::ClockedScene;
use crate::error::{Error, Result};
use crate::log::summary::{CpuTimes, Memory, Times};
use crate::scene::camera::ImageSize;
use crate::system;
use serde::Deserialize;
use std::ffi::OsString;
use std::io::Read as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// When a run ends.
#[derive(Clone, Copy, Debug)]
pub enum Limit {
    /// `--time`.
    Time(Duration),
    /// `--rays`.
    Rays(u64),
}

/// A run, from the start of its process to its end.
#[derive(Clone, Debug)]
pub struct Timed {
    /// Wall-clock seconds.
    pub wall: f64,
    /// CPU seconds; `None` where the system does not tell.
    pub cpu: Option<f64>,
    /// What it says of itself.
    pub reported: Reported,
}

/// What is read of a run's summary.
#[derive(Clone, Debug, Deserialize)]
pub struct Reported {
    /// Name of the Vulkan device.
    pub device: String,
    /// Its driver.
    pub driver: String,
    /// When frames were there, by the wall clock.
    pub times: Times,
    /// By the process's CPU clock.
    pub cpu: CpuTimes,
    /// At the end.
    pub memory: Memory,
}

/// Starts runs of this program, and keeps their files while they are looked at.
pub struct Renders<'a> {
    args: &'a ClockArgs,
    program: PathBuf,
    folder: TempDir,
}

impl<'a> Renders<'a> {
    /// Runs with the threads and the device that the options name.
    ///
    /// # Errors
    /// [`Error::Io`] if there is no place for their files, or the program has gone.
    pub fn new(args: &'a ClockArgs) -> Result<Self> {
        let program = std::env::current_exe().map_err(|e| Error::io(Path::new("penombre"), "cannot find", e))?;
        let folder = tempfile::tempdir().map_err(|e| Error::io(&std::env::temp_dir(), "cannot make a folder in", e))?;
        Ok(Self { args, program, folder })
    }

    /// The image that the last run has written.
    #[must_use]
    pub fn image(&self) -> PathBuf {
        self.folder.path().join("image.exr")
    }

    /// Renders a scene once; `None` if it was broken off.
    ///
    /// # Errors
    /// As the run's own; its message says which.
    pub fn run(&self, scene: &ClockedScene, size: ImageSize, limit: Limit, seed: u64) -> Result<Option<Timed>> {
        let log = self.folder.path().join("frames.csv");
        let mut command = Command::new(&self.program);
        command.args(["render", "-q", "--size", &size.to_string(), "--seed", &seed.to_string()]);
        command.arg("-o").arg(self.image()).arg("--log").arg(&log);
        match limit {
            Limit::Time(time) => command.args(["--time", &time.as_secs_f64().to_string()]),
            Limit::Rays(rays) => command.args(["--rays", &rays.to_string()]),
        };
        command.args(scene.camera.iter().map(|name| with_value("--camera", name)));
        command.args(self.args.device.device.iter().map(|device| with_value("--device", device)));
        command.args(self.args.cpu.threads.iter().map(|threads| with_value("--threads", &threads.to_string())));
        // Behind `--` no path is taken for an option.
        command.arg("--").arg(&scene.path);
        let spent = system::children_cpu_seconds();
        let start = Instant::now();
        let Some(ended) = Running::start(&mut command)?.wait()? else { return Ok(None) };
        let wall = start.elapsed().as_secs_f64();
        let cpu = system::children_cpu_seconds().zip(spent).map(|(now, before)| now - before);
        match ended.status.code() {
            Some(0) => Ok(Some(Timed { wall, cpu, reported: read(&log.with_extension("json"))? })),
            Some(code) if code == i32::from(interrupt::EXIT_STATUS) => Ok(None),
            code => Err(ended.error(code)),
        }
    }
}

/// An option and its value in one word, so that the value is never taken for an option.
fn with_value(option: &str, value: &str) -> OsString {
    format!("{option}={value}").into()
}

fn read(summary: &Path) -> Result<Reported> {
    let text = std::fs::read(summary).map_err(|e| Error::io(summary, "cannot read", e))?;
    serde_json::from_slice(&text).map_err(|e| Error::Internal(format!("{}: {e}", summary.display())))
}

/// A process that does not outlive this value.
struct Running(Child);

/// A process that has ended.
struct Ended {
    status: ExitStatus,
    /// What it said on standard error.
    said: String,
}

impl Running {
    fn start(command: &mut Command) -> Result<Self> {
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped());
        command.spawn().map(Self).map_err(|e| Error::io(Path::new(command.get_program()), "cannot start", e))
    }

    /// Waits for its end, which the end of its messages tells at once; `None` if a signal came first.
    fn wait(mut self) -> Result<Option<Ended>> {
        const TICK: Duration = Duration::from_millis(20);
        let (tell, told) = mpsc::channel();
        let messages = self.0.stderr.take();
        let reader = std::thread::Builder::new().name("penombre-messages".to_owned()).spawn(move || {
            let mut said = Vec::new();
            // What could be read of them is good enough.
            let _ = messages.map(|mut messages| messages.read_to_end(&mut said));
            let _ = tell.send(String::from_utf8_lossy(&said).into_owned());
        });
        reader.map_err(|e| Error::Exhausted(format!("cannot start a thread: {e}")))?;
        loop {
            match told.recv_timeout(TICK) {
                Err(RecvTimeoutError::Timeout) if interrupt::requested() => return Ok(None),
                Err(RecvTimeoutError::Timeout) => {}
                said => {
                    let status = self.0.wait().map_err(|e| Error::Internal(format!("cannot wait for a run: {e}")))?;
                    return Ok(Some(Ended { status, said: said.unwrap_or_default() }));
                }
            }
        }
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        // One that has ended is not there to be killed.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

impl Ended {
    fn error(self, code: Option<i32>) -> Error {
        let said = self.said.trim().trim_start_matches("error: ").to_owned();
        match code {
            Some(2) => Error::Usage(said),
            Some(3) => Error::NoDevice(said),
            Some(4) => Error::Exhausted(said),
            _ => Error::Internal(format!("a run ended with {}: {said}", self.status)),
        }
    }
}

#[cfg(test)]
#[cfg(unix)]
mod tests {
    use super::*;

    #[test]
    fn a_process_ends_by_itself_or_with_its_value() {
        let sh = |line: &str| Running::start(Command::new("sh").args(["-c", line])).expect("started");
        let ended = sh("echo error: no >&2; exit 2").wait().expect("waited").expect("no signal");
        assert_eq!((ended.status.code(), ended.said.as_str()), (Some(2), "error: no\n"));
        assert!(matches!(ended.error(Some(2)), Error::Usage(said) if said == "no"));
        let folder = tempfile::tempdir().expect("folder");
        let late = folder.path().join("late");
        let start = Instant::now();
        let running = sh(&format!("trap '' INT TERM; echo >{0}.ready; sleep 0.3; echo >{0}", late.display()));
        while !late.with_extension("ready").exists() {
            assert!(start.elapsed() < Duration::from_secs(30), "it does not start");
            std::thread::sleep(Duration::from_millis(1));
        }
        drop(running);
        std::thread::sleep(Duration::from_millis(500));
        assert!(!late.exists(), "it went on");
    }
}
