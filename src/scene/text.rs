//! Lines, words and numbers of OBJ and MTL files, which are bytes in no certain encoding.

use super::report::Report;
use glam::DVec3;
use std::collections::HashMap;
use std::path::Path;

/// Longest logical line that is read, bytes; a face of half a million corners fits, and no more than a few hundred MiB come of it.
const MAX_LINE: usize = 16 << 20;
/// What is said of a longer one.
pub(super) const TOO_LONG: &str = "the line is longer than 16 MiB and is left out";

/// Faults of one kind that are listed one by one; the rest are counted.
const LISTED: usize = 10;

/// The logical lines of a file: continuation lines (`\` at the end) joined, comments and blank lines left out.
///
/// A lending iterator: a joined line lives in a buffer that the next one overwrites.
pub(super) struct Lines<'t> {
    rest: &'t [u8],
    terminator: u8,
    /// Number of the physical line that comes next.
    next_number: u32,
    joined: Vec<u8>,
}

impl<'t> Lines<'t> {
    /// Lines of `bytes`, ended by LF, CR LF or, in files without any LF, CR.
    pub(super) fn new(bytes: &'t [u8]) -> Self {
        let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        let old_mac = memchr::memchr(b'\n', bytes).is_none() && memchr::memchr(b'\r', bytes).is_some();
        Self { rest: bytes, terminator: if old_mac { b'\r' } else { b'\n' }, next_number: 1, joined: Vec::new() }
    }

    fn physical(&mut self) -> Option<&'t [u8]> {
        if self.rest.is_empty() {
            return None;
        }
        self.next_number += 1;
        let (line, rest) = match memchr::memchr(self.terminator, self.rest) {
            Some(end) => (&self.rest[..end], &self.rest[end + 1..]),
            None => (self.rest, &[][..]),
        };
        self.rest = rest;
        Some(line.trim_ascii())
    }

    /// The next line that says something, trimmed, with the number of its first physical line.
    ///
    /// Too long a line comes back as `Err` with its number.
    pub(super) fn next(&mut self) -> Option<Result<(u32, &[u8]), u32>> {
        let (number, first) = loop {
            let number = self.next_number;
            let line = self.physical()?;
            if !line.is_empty() && line[0] != b'#' {
                break (number, line);
            }
        };
        let Some(mut head) = first.strip_suffix(b"\\") else {
            return Some(if first.len() > MAX_LINE { Err(number) } else { Ok((number, first)) });
        };
        self.joined.clear();
        loop {
            if self.joined.len() <= MAX_LINE {
                self.joined.extend_from_slice(&head[..head.len().min(MAX_LINE)]);
                self.joined.push(b' ');
            }
            let Some(line) = self.physical() else { break };
            match line.strip_suffix(b"\\") {
                Some(more) => head = more,
                None => {
                    self.joined.extend_from_slice(&line[..line.len().min(MAX_LINE)]);
                    break;
                }
            }
        }
        Some(if self.joined.len() > MAX_LINE { Err(number) } else { Ok((number, self.joined.trim_ascii())) })
    }
}

/// Splits a line into its keyword and the rest.
pub(super) fn keyword(line: &[u8]) -> (&[u8], &[u8]) {
    let end = line.iter().position(u8::is_ascii_whitespace).unwrap_or(line.len());
    (&line[..end], line[end..].trim_ascii_start())
}

/// The words of a line, up to a comment.
pub(super) fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    line.split(u8::is_ascii_whitespace).filter(|w| !w.is_empty()).take_while(|w| w[0] != b'#')
}

/// A finite number, or `None`.
pub(super) fn number(word: &[u8]) -> Option<f32> {
    std::str::from_utf8(word).ok()?.parse::<f32>().ok().filter(|x| x.is_finite())
}

/// The first three words as a position, in double precision.
pub(super) fn position(rest: &[u8]) -> Option<DVec3> {
    let mut numbers = words(rest).map(|word| std::str::from_utf8(word).ok()?.parse::<f64>().ok());
    Some(DVec3::new(numbers.next()??, numbers.next()??, numbers.next()??))
}

/// Text of a name: UTF-8 where it is, Latin-1 otherwise.
pub(super) fn decode(bytes: &[u8]) -> String {
    match std::str::from_utf8(bytes) {
        Ok(text) => text.to_owned(),
        Err(_) => bytes.iter().map(|&b| char::from(b)).collect(),
    }
}

/// A name without the comment after it; `None` where there is none. `#` and a digit after a blank belong to the name, as in
/// `Material #25`, which 3ds Max writes.
pub(super) fn uncommented(name: &str) -> Option<&str> {
    let is_comment = |&(at, _): &(usize, &str)| {
        name[..at].ends_with([' ', '\t']) && !name[at + 1..].starts_with(|c: char| c.is_ascii_digit())
    };
    let (at, _) = name.match_indices('#').find(is_comment)?;
    Some(name[..at].trim_end()).filter(|name| !name.is_empty())
}

/// A word for a message: readable, and never long.
pub(super) fn quote(word: &[u8]) -> String {
    let text: String = decode(&word[..word.len().min(40)]).chars().filter(|c| !c.is_control()).collect();
    if word.len() > 40 { format!("`{text}…`") } else { format!("`{text}`") }
}

/// Warnings about one file, of which those beyond the tenth of a kind are only counted.
pub(super) struct Warnings<'a> {
    file: &'a Path,
    report: Report,
    seen: HashMap<&'static str, Kind>,
}

#[derive(Default)]
struct Kind {
    count: usize,
    /// Line of the first one that is not listed.
    first_hidden: u32,
    /// Order of appearance, for a stable report.
    rank: usize,
}

impl<'a> Warnings<'a> {
    /// No warnings about `file` yet.
    pub(super) fn new(file: &'a Path) -> Self {
        Self { file, report: Report::default(), seen: HashMap::new() }
    }

    /// Notes a fault of `kind` at `line`; the message is only made when it is listed.
    pub(super) fn add(&mut self, kind: &'static str, line: u32, message: impl FnOnce() -> String) {
        let rank = self.seen.len();
        let entry = self.seen.entry(kind).or_insert(Kind { rank, ..Kind::default() });
        entry.count += 1;
        if entry.count <= LISTED {
            self.report.warn(self.file, Some(line), message());
        } else if entry.count == LISTED + 1 {
            entry.first_hidden = line;
        }
    }

    /// Notes what holds for the whole file, where it is seen first.
    pub(super) fn once(&mut self, kind: &'static str, line: u32, message: impl FnOnce() -> String) {
        if !self.seen.contains_key(kind) {
            self.add(kind, line, message);
        }
    }

    /// The report, with one line for the hidden faults of each kind.
    pub(super) fn finish(mut self) -> Report {
        let mut hidden: Vec<_> = self.seen.iter().filter(|(_, kind)| kind.count > LISTED).collect();
        hidden.sort_by_key(|(_, kind)| kind.rank);
        for (name, kind) in hidden {
            let message = format!("{name}: and {} more like it", kind.count - LISTED);
            self.report.warn(self.file, Some(kind.first_hidden), message);
        }
        self.report
    }
}
