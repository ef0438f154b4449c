//! Faults of the input: every one with its place, all reported at once.

use std::fmt;
use std::path::{Path, PathBuf};

/// Where in the input something is wrong.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// File.
    pub file: PathBuf,
    /// Line, from 1; `None` when the whole file is meant.
    pub line: Option<u32>,
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.line {
            Some(line) => write!(f, "{}:{line}", self.file.display()),
            None => write!(f, "{}", self.file.display()),
        }
    }
}

/// Whether a fault refuses the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Severity {
    /// The scene can be drawn without it.
    Warning,
    /// Something is drawn by a simpler model than the scene asks for, or not at all, until that is supported.
    StandIn,
    /// The scene cannot be drawn.
    Error,
}

/// One thing wrong: what, where, what to do.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fault {
    /// Whether it refuses the scene.
    pub severity: Severity,
    /// Where.
    pub place: Place,
    /// What is wrong and what to do, without a full stop at the end.
    pub message: String,
}

impl Fault {
    /// The material that a message is about, and what it says of it.
    fn of_material(&self) -> (Option<&str>, &str) {
        let named = self.message.strip_prefix("material ").and_then(|rest| rest.split_once(": "));
        named.map_or((None, &self.message), |(name, what)| (Some(name), what))
    }
}

/// How many names a line holds at most.
const MAX_NAMES: usize = 8;

fn collapsed_line(first: &Fault, names: &[&str]) -> String {
    if names.len() < 2 {
        return first.to_string();
    }
    let more = names.len().saturating_sub(MAX_NAMES);
    let and_more = if more > 0 { format!(" and {more} more") } else { String::new() };
    let listed = names[..names.len() - more].join(", ");
    let message = format!("materials {listed}{and_more}: {}", first.of_material().1);
    Fault { message, ..first.clone() }.to_string()
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let kind = match self.severity {
            Severity::Warning | Severity::StandIn => "warning",
            Severity::Error => "error",
        };
        write!(f, "{}: {kind}: {}", self.place, self.message)
    }
}

/// The faults found while loading, in the order in which they were found.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Report {
    /// All of them.
    pub faults: Vec<Fault>,
}

impl Report {
    /// Notes a fault that refuses the scene.
    pub fn error(&mut self, file: &Path, line: Option<u32>, message: impl Into<String>) {
        self.push(Severity::Error, file, line, message.into());
    }

    /// Notes a fault that the scene can be drawn with.
    pub fn warn(&mut self, file: &Path, line: Option<u32>, message: impl Into<String>) {
        self.push(Severity::Warning, file, line, message.into());
    }

    /// Notes that a simpler model stands in for what the scene asks for.
    pub fn stand_in(&mut self, file: &Path, line: Option<u32>, message: impl Into<String>) {
        self.push(Severity::StandIn, file, line, message.into());
    }

    fn push(&mut self, severity: Severity, file: &Path, line: Option<u32>, message: String) {
        self.faults.push(Fault { severity, place: Place { file: file.to_owned(), line }, message });
    }

    /// The faults of one kind as they are printed, each with its place.
    #[must_use]
    pub fn lines(&self, severity: Severity) -> Vec<String> {
        self.faults.iter().filter(|f| f.severity == severity).map(ToString::to_string).collect()
    }

    /// All faults, those that say the same of several materials of a file in one line, in the order of the first.
    #[must_use]
    pub fn collapsed(&self) -> Vec<String> {
        let mut groups: Vec<(&Fault, Vec<&str>)> = Vec::new();
        for fault in &self.faults {
            let (material, what) = fault.of_material();
            let alike = |(first, _): &&mut (&Fault, Vec<&str>)| {
                first.of_material().1 == what
                    && first.severity == fault.severity
                    && first.place.file == fault.place.file
            };
            match (material, groups.iter_mut().find(alike)) {
                (Some(name), Some((_, names))) => names.push(name),
                _ => groups.push((fault, material.into_iter().collect())),
            }
        }
        groups.iter().map(|(first, names)| collapsed_line(first, names)).collect()
    }

    /// Whether any fault refuses the scene.
    #[must_use]
    pub fn has_errors(&self) -> bool {
        self.faults.iter().any(|f| f.severity == Severity::Error)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_said_of_many_materials_is_one_line() {
        let (a, b) = (Path::new("a.mtl"), Path::new("b.mtl"));
        let mut report = Report::default();
        report.stand_in(a, Some(3), "material Tin: no mirrors");
        report.warn(a, Some(4), "material Tin: too bright");
        report.stand_in(a, Some(9), "material Zinc: no mirrors");
        report.stand_in(b, Some(1), "material Zinc: no mirrors");
        report.warn(a, None, "no light");
        report.warn(a, None, "no light");
        assert_eq!(
            report.collapsed(),
            [
                "a.mtl:3: warning: materials Tin, Zinc: no mirrors",
                "a.mtl:4: warning: material Tin: too bright",
                "b.mtl:1: warning: material Zinc: no mirrors",
                "a.mtl: warning: no light",
                "a.mtl: warning: no light",
            ]
        );
        assert_eq!(report.lines(Severity::StandIn).len(), 3);
        for i in 0..18 {
            report.stand_in(b, Some(i), format!("material M{i}: no mirrors"));
        }
        let long = report.collapsed().into_iter().find(|l| l.starts_with("b.mtl")).expect("a line");
        assert_eq!(long, "b.mtl:1: warning: materials Zinc, M0, M1, M2, M3, M4, M5, M6 and 11 more: no mirrors");
    }
}
