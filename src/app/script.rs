//! Scripts: commands with their times, one a line.

use super::command::{Command, nearest};
use super::table;
use super::words::split;
use crate::error::{Error, Result};
use crate::scene::Scene;
use crate::scene::light::why_fixed;
use crate::scene::report::Report;
use std::path::{Path, PathBuf};

/// The longest time that a script may name, seconds: a day.
const MOST_SECONDS: f64 = 86_400.0;

/// A command at a time.
#[derive(Clone, Debug, PartialEq)]
pub struct Step {
    /// Seconds from the first picture.
    pub time: f64,
    /// What is done then.
    pub command: Command,
    /// Line of the file, from 1.
    pub line: u32,
}

/// Commands in the order of their times; those of one time in the order of the file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Script {
    /// Where it was read from.
    pub file: PathBuf,
    /// All of it.
    pub steps: Vec<Step>,
}

impl Script {
    /// Reads a script.
    ///
    /// # Errors
    /// [`Error::Io`] if it cannot be read, [`Error::Input`] with all its faults.
    pub fn load(file: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(file).map_err(|e| Error::io(file, "cannot read", e))?;
        Self::read(file, &text)
    }

    fn read(file: &Path, text: &str) -> Result<Self> {
        let mut report = Report::default();
        let mut steps = Vec::new();
        for (line, number) in text.lines().zip(1..) {
            match step(line) {
                Ok(Some((time, command))) => steps.push(Step { time, command, line: number }),
                Ok(None) => {}
                Err(fault) => report.error(file, Some(number), fault),
            }
        }
        steps.sort_by(|a, b| a.time.total_cmp(&b.time));
        if report.has_errors() { Err(Error::Input(report)) } else { Ok(Self { file: file.to_owned(), steps }) }
    }

    /// Checks that the lights and cameras that it names are there.
    ///
    /// # Errors
    /// [`Error::Input`] with every one that is not.
    pub fn check(&self, scene: &Scene) -> Result<()> {
        let mut report = Report::default();
        for Step { command, line, .. } in &self.steps {
            if let Err(fault) = check(command, scene) {
                report.error(&self.file, Some(*line), fault);
            }
        }
        if report.has_errors() { Err(Error::Input(report)) } else { Ok(()) }
    }

    /// Time of the last command, seconds.
    #[must_use]
    pub fn duration(&self) -> f64 {
        self.steps.last().map_or(0.0, |step| step.time)
    }
}

/// Checks that the light or camera that a command names is there, and can be moved if it is to be.
///
/// # Errors
/// What is not, and what was perhaps meant.
pub fn check(command: &Command, scene: &Scene) -> Result<(), String> {
    let lights = || scene.lights.iter().map(|light| light.name.as_str());
    let cameras = || scene.cameras.iter().map(|camera| camera.name.as_str());
    match command {
        Command::ToggleLight(name)
        | Command::DimLight(name, _)
        | Command::ColourLight(name, _)
        | Command::MoveLight(name, _)
        | Command::View(_, Some(name))
            if lights().all(|known| known != name) =>
        {
            Err(missing("light", name, lights()))
        }
        Command::MoveLight(name, to) if !(*to - scene.origin).as_vec3().is_finite() => {
            Err(format!("{name:?} would be too far away"))
        }
        Command::MoveLight(name, _) => {
            let why = why_fixed(&scene.lights, name);
            why.map_or(Ok(()), |why| Err(format!("{name:?} {why}")))
        }
        Command::View(view, _) if view.of_light && scene.lights.is_empty() => {
            Err(format!("the scene has no light for the view {}", view.name))
        }
        Command::Go(name) if cameras().all(|known| known != name) && !is_number_of(name, scene) => {
            Err(missing("camera", name, cameras()))
        }
        _ => Ok(()),
    }
}

/// Whether a word is the number of a camera, or 0.
fn is_number_of(word: &str, scene: &Scene) -> bool {
    word.parse::<usize>().is_ok_and(|number| number <= scene.cameras.len())
}

fn missing<'a>(kind: &str, name: &str, known: impl Iterator<Item = &'a str> + Clone) -> String {
    match nearest(name, known.clone()) {
        Some(near) => format!("the scene has no {kind} {name:?}: did you mean {near:?}?"),
        None => format!("the scene has no {kind} {name:?}; it has {}", known.take(8).collect::<Vec<_>>().join(", ")),
    }
}

/// The command of a line; `None` for an empty one.
fn step(line: &str) -> Result<Option<(f64, Command)>, String> {
    let words = split(line)?;
    let Some((time, command)) = words.split_first() else { return Ok(None) };
    let time = time
        .parse::<f64>()
        .ok()
        .filter(|seconds| (0.0..=MOST_SECONDS).contains(seconds))
        .ok_or_else(|| format!("{time}: expected a time in seconds first, as in `1.5 light.toggle lamp`"))?;
    Ok(Some((time, table::parse(command)?)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::light::{Light, LightKind};
    use crate::scene::report::Severity;
    use glam::Vec3;

    fn read(text: &str) -> Result<Script> {
        Script::read(Path::new("walk.script"), text)
    }

    fn faults(result: Result<impl std::fmt::Debug>) -> Vec<String> {
        let Err(Error::Input(report)) = result else { panic!("{result:?} was accepted") };
        report.lines(Severity::Error)
    }

    #[test]
    fn commands_come_in_the_order_of_their_times() {
        let text =
            "# a walk\n2 app.quit\n\n0.5 camera.fly 0 0 1 # off\n0.5 camera.look 10 0\n0 light.toggle \"light 1\"\n";
        let script = read(text).unwrap();
        let lines: Vec<u32> = script.steps.iter().map(|step| step.line).collect();
        assert_eq!((lines, script.duration()), (vec![6, 4, 5, 2], 2.0));
        assert_eq!(script.steps[0].command, Command::ToggleLight("light 1".to_owned()));
        assert_eq!(read("").unwrap().duration(), 0.0);
    }

    #[test]
    fn all_faults_are_listed_with_their_lines() {
        let lines = faults(read("now app.quit\n1\n1 camera.fly 1\n-1 app.quit\n1 app.quit\n1 light.dim \"a 1\n"));
        let begin = |n: u32| format!("walk.script:{n}: error: ");
        assert_eq!(lines.len(), 5, "{lines:?}");
        for (line, (number, what)) in lines.iter().zip([
            (1, "expected a time"),
            (2, "a command is missing"),
            (3, "camera.fly RIGHT UP FORWARD"),
            (4, "expected a time"),
            (6, "not closed"),
        ]) {
            assert!(line.starts_with(&begin(number)) && line.contains(what), "{line}");
        }
    }

    #[test]
    fn lights_and_cameras_that_are_not_there_are_faults() {
        let kind = LightKind::Directional { direction: Vec3::X, irradiance: Vec3::ONE };
        let scene = Scene { lights: vec![Light { name: "lamp".to_owned(), kind }], ..Scene::default() };
        let script = read("0 light.toggle lamb\n1 light.dim lamp 0\n2 camera.go 0\n3 camera.go 7\n").unwrap();
        let lines = faults(script.check(&scene));
        assert_eq!(lines[0], "walk.script:1: error: the scene has no light \"lamb\": did you mean \"lamp\"?");
        assert!(lines.len() == 2 && lines[1].contains("no camera \"7\""), "{lines:?}");
    }
}
