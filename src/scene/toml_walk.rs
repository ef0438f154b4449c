//! Walking a TOML document by hand, so that every fault is found, with its line.

use super::report::Report;
use glam::{DVec3, Vec3};
use std::ops::Range;
use std::path::Path;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// A TOML file and what is wrong with it.
pub(super) struct Document<'a> {
    file: &'a Path,
    text: &'a str,
    /// Offsets of the line feeds.
    line_ends: Vec<usize>,
    report: Report,
    /// What is subtracted from positions.
    origin: DVec3,
}

/// A value with its line.
#[derive(Clone, Copy, Debug)]
pub(super) struct At<T> {
    /// The value.
    pub value: T,
    /// Line, from 1.
    pub line: u32,
}

impl<'a> Document<'a> {
    /// Reads `text`, in which positions are given in the coordinates of the file: they are moved so that `origin` becomes the
    /// origin. Syntax errors are noted, what could be read is returned.
    pub(super) fn parse(file: &'a Path, text: &'a str, origin: DVec3) -> (Self, Spanned<DeTable<'a>>) {
        let (root, errors) = DeTable::parse_recoverable(text);
        let line_ends = memchr::memchr_iter(b'\n', text.as_bytes()).collect();
        let mut document = Self { file, text, line_ends, report: Report::default(), origin };
        for error in errors {
            let line = error.span().map_or(1, |span| document.line(span));
            document.error(line, format!("TOML: {}", error.message().replace('\n', ", ")));
        }
        (document, root)
    }

    /// Notes an error.
    pub(super) fn error(&mut self, line: u32, message: impl Into<String>) {
        self.report.error(self.file, Some(line), message);
    }

    /// The faults, by line.
    pub(super) fn finish(mut self) -> Report {
        self.report.faults.sort_by_key(|f| f.place.line);
        self.report
    }

    fn line(&self, span: Range<usize>) -> u32 {
        1 + self.line_ends.partition_point(|&end| end < span.start) as u32
    }

    /// What stands at `span`, shortened for a message.
    fn excerpt(&self, span: Range<usize>) -> String {
        let written = self.text.get(span).unwrap_or_default();
        let short: String = written.lines().next().unwrap_or_default().chars().take(40).collect();
        if short.len() < written.len() { format!("{short}…") } else { short }
    }
}

/// One table of a document: each key that is asked for is a known key.
pub(super) struct Table<'d, 'a> {
    document: &'d mut Document<'a>,
    entries: &'d DeTable<'a>,
    /// What messages call the table, e.g. `[[light]]`.
    title: &'static str,
    /// Line of its header.
    pub line: u32,
    known: Vec<&'static str>,
    accepts_all: bool,
}

impl<'d, 'a> Table<'d, 'a> {
    /// The root of a document.
    pub(super) fn root(document: &'d mut Document<'a>, root: &'d Spanned<DeTable<'a>>) -> Self {
        Self { document, entries: root.get_ref(), title: "the file", line: 1, known: Vec::new(), accepts_all: false }
    }

    fn find(&mut self, key: &'static str) -> Option<&'d Spanned<DeValue<'a>>> {
        self.known.push(key);
        self.entries.iter().find(|(k, _)| k.get_ref() == key).map(|(_, value)| value)
    }

    /// Runs `read` on every table of `key`, which may be a table or an array of tables.
    pub(super) fn tables<T>(
        &mut self,
        key: &'static str,
        title: &'static str,
        mut read: impl FnMut(&mut Table<'_, 'a>) -> T,
    ) -> Vec<At<T>> {
        let mut out = Vec::new();
        let Some(value) = self.find(key) else { return out };
        let items = match value.get_ref() {
            DeValue::Array(items) => items.iter().collect(),
            _ => vec![value],
        };
        for item in items {
            let line = self.document.line(item.span());
            let DeValue::Table(entries) = item.get_ref() else {
                self.document.error(line, format!("{key} must be a table: write {title}"));
                continue;
            };
            let mut table =
                Table { document: &mut *self.document, entries, title, line, known: Vec::new(), accepts_all: false };
            let value = read(&mut table);
            table.reject_unknown();
            out.push(At { value, line });
        }
        out
    }

    /// Counts all keys as known: for a table whose own kind is wrong, so that nothing sensible can be said of the rest.
    pub(super) fn accept_all(&mut self) {
        self.known.clear();
        self.accepts_all = true;
    }

    /// Notes keys that nobody asked for, with the nearest that somebody did.
    pub(super) fn reject_unknown(&mut self) {
        if self.accepts_all {
            return;
        }
        for (key, _) in self.entries.iter().filter(|(k, _)| !self.known.contains(&k.get_ref().as_ref())) {
            let name = key.get_ref();
            let nearest = nearest(name, self.known.iter().copied());
            let line = self.document.line(key.span());
            let hint = match nearest {
                Some(nearest) => format!("did you mean {nearest}?"),
                None => format!("it has {}", self.known.join(", ")),
            };
            self.document.error(line, format!("unknown key {name} in {}: {hint}", self.title));
        }
    }

    /// Notes an error at the table's header.
    pub(super) fn error(&mut self, line: u32, message: impl Into<String>) {
        self.document.error(line, message);
    }

    /// Notes what the scene can be drawn with.
    pub(super) fn warn(&mut self, line: u32, message: impl Into<String>) {
        self.document.report.warn(self.document.file, Some(line), message);
    }

    /// Whether a key is there, right or wrong.
    pub(super) fn has(&self, key: &str) -> bool {
        self.entries.iter().any(|(k, _)| k.get_ref() == key)
    }

    /// `value`, or an error that `key` is missing. A key that is there but wrong has its own error already.
    pub(super) fn required<T>(&mut self, key: &'static str, value: Option<At<T>>) -> Option<At<T>> {
        if value.is_none() && !self.has(key) {
            self.document.error(self.line, format!("{} lacks {key}", self.title));
        }
        value
    }

    fn typed<T>(
        &mut self,
        key: &'static str,
        expected: &str,
        read: impl FnOnce(&DeValue<'a>) -> Option<T>,
    ) -> Option<At<T>> {
        let found = self.find(key)?;
        let line = self.document.line(found.span());
        match read(found.get_ref()) {
            Some(value) => Some(At { value, line }),
            None => {
                let got = self.document.excerpt(found.span());
                self.document.error(line, format!("{key} must be {expected}, this is {got}"));
                None
            }
        }
    }

    /// A finite number.
    pub(super) fn number(&mut self, key: &'static str) -> Option<At<f32>> {
        self.typed(key, "a finite number", number)
    }

    /// A finite number inside `range`, else an error that says `bounds`.
    pub(super) fn number_in(
        &mut self,
        key: &'static str,
        bounds: &str,
        inside: impl FnOnce(f32) -> bool,
    ) -> Option<At<f32>> {
        let found = self.number(key)?;
        if inside(found.value) {
            return Some(found);
        }
        self.document.error(found.line, format!("{key} must be {bounds}, this is {}", found.value));
        None
    }

    /// Three finite numbers.
    pub(super) fn vector(&mut self, key: &'static str) -> Option<At<Vec3>> {
        self.typed(key, THREE_NUMBERS, |value| vector(value).map(DVec3::as_vec3).filter(|v| v.is_finite()))
    }

    /// A position, moved as the document says.
    pub(super) fn position(&mut self, key: &'static str) -> Option<At<Vec3>> {
        let origin = self.document.origin;
        let moved = |value: &DeValue<'a>| vector(value).map(|v| (v - origin).as_vec3()).filter(|v| v.is_finite());
        self.typed(key, THREE_NUMBERS, moved)
    }

    /// Three finite numbers of at least 0: a colour.
    pub(super) fn colour(&mut self, key: &'static str) -> Option<At<Vec3>> {
        let found = self.vector(key)?;
        if found.value.min_element() >= 0.0 {
            return Some(found);
        }
        self.document.error(found.line, format!("{key} must not be negative, this is {}", found.value));
        None
    }

    /// A number of at least 0, or three: a factor by channel.
    pub(super) fn factor(&mut self, key: &'static str) -> Option<At<Vec3>> {
        let read = |value: &DeValue<'a>| {
            let factor = number(value).map(Vec3::splat).or_else(|| vector(value).map(DVec3::as_vec3));
            factor.filter(|f| f.is_finite() && f.min_element() >= 0.0)
        };
        self.typed(key, "a number of at least 0, or an array of three", read)
    }

    /// True or false.
    pub(super) fn boolean(&mut self, key: &'static str) -> Option<At<bool>> {
        self.typed(key, "true or false", |value| value.as_bool())
    }

    /// A date or a time, as TOML has them or in quotes: its text.
    pub(super) fn date_or_time(&mut self, key: &'static str) -> Option<At<String>> {
        let text = |value: &DeValue<'a>| match value {
            DeValue::Datetime(at) => Some(at.to_string()),
            other => other.as_str().map(str::to_owned),
        };
        self.typed(key, "a date or a time of day", text)
    }

    /// A string.
    pub(super) fn string(&mut self, key: &'static str) -> Option<At<String>> {
        self.typed(key, "a string", |value| value.as_str().map(str::to_owned))
    }

    /// A string or an array of strings, each with its line.
    pub(super) fn strings(&mut self, key: &'static str) -> Option<Vec<At<String>>> {
        let found = self.find(key)?;
        let items = match found.get_ref() {
            DeValue::Array(items) => items.iter().collect(),
            _ => vec![found],
        };
        let mut out = Vec::new();
        for item in items {
            let line = self.document.line(item.span());
            match item.get_ref().as_str() {
                Some(text) => out.push(At { value: text.to_owned(), line }),
                None => {
                    let got = self.document.excerpt(item.span());
                    self.document.error(line, format!("{key} must be file names in quotes, this is {got}"));
                }
            }
        }
        Some(out)
    }

    /// One of several names, each standing for a value.
    pub(super) fn choice<T: Copy>(&mut self, key: &'static str, names: &[(&str, T)]) -> Option<At<T>> {
        let found = self.string(key)?;
        if let Some((_, value)) = names.iter().find(|(name, _)| *name == found.value) {
            return Some(At { value: *value, line: found.line });
        }
        let all: Vec<&str> = names.iter().map(|(name, _)| *name).collect();
        let hint = match nearest(&found.value, all.iter().copied()) {
            Some(near) => format!("did you mean {near:?}?"),
            None => format!("it may be {}", all.join(", ")),
        };
        self.document.error(found.line, format!("{key} cannot be {:?}: {hint}", found.value));
        None
    }
}

/// What a vector has to be.
const THREE_NUMBERS: &str = "an array of three finite numbers";

fn vector(value: &DeValue) -> Option<DVec3> {
    let items = value.as_array()?;
    let numbers: Option<Vec<f64>> = items.iter().map(|item| double(item.get_ref())).collect();
    <[f64; 3]>::try_from(numbers?).ok().map(DVec3::from)
}

/// A number of TOML as a finite f32.
fn number(value: &DeValue) -> Option<f32> {
    double(value).map(|wide| wide as f32).filter(|narrow| narrow.is_finite())
}

fn double(value: &DeValue) -> Option<f64> {
    match value {
        DeValue::Float(float) => float.as_str().parse().ok(),
        DeValue::Integer(integer) => i64::from_str_radix(integer.as_str(), integer.radix()).ok().map(|i| i as f64),
        _ => None,
    }
}

/// The known name that is most like another, if any is.
pub(super) fn nearest<'n>(name: &str, known: impl Iterator<Item = &'n str>) -> Option<&'n str> {
    let scored = known.map(|k| (strsim::jaro_winkler(name, k), k));
    scored.filter(|(score, _)| *score > 0.75).max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, k)| k)
}
