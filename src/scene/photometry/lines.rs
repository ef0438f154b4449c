//! Numbers of a text, with the lines that they stand in.

use super::fault::{Fault, MAX_ANGLES};

/// What is left of a text.
pub(super) struct Lines<'a> {
    rest: std::iter::Enumerate<std::str::Lines<'a>>,
    /// Words of the present line.
    words: Vec<&'a str>,
    /// Line that was read last, from 1.
    pub line: u32,
}

impl<'a> Lines<'a> {
    pub(super) fn new(text: &'a str) -> Self {
        Self { rest: text.lines().enumerate(), words: Vec::new(), line: 0 }
    }

    /// The next line whole.
    pub(super) fn next_line(&mut self) -> Option<&'a str> {
        self.words.clear();
        let (index, line) = self.rest.next()?;
        self.line = index as u32 + 1;
        Some(line.trim())
    }

    /// The next number, on whatever line; `what` it is.
    pub(super) fn number(&mut self, what: &str) -> Result<f32, Fault> {
        while self.words.is_empty() {
            let Some(line) = self.next_line() else {
                return Err(Fault::new(self.line.max(1), format!("the file ends where {what} should stand")));
            };
            let separators = |c: char| c.is_whitespace() || c == ',';
            self.words = line.split(separators).filter(|word| !word.is_empty()).rev().collect();
        }
        let word = self.words.pop().unwrap_or_default();
        self.parse(word, what)
    }

    /// The number that a line of its own holds; decimal commas are known.
    pub(super) fn number_of_line(&mut self, what: &str) -> Result<f32, Fault> {
        let Some(line) = self.next_line() else {
            return Err(Fault::new(self.line.max(1), format!("the file ends where {what} should stand")));
        };
        let word = line.split_whitespace().next().unwrap_or_default().replace(',', ".");
        self.parse(&word, what)
    }

    fn parse(&self, word: &str, what: &str) -> Result<f32, Fault> {
        let fault =
            || Fault::new(self.line, format!("{what} is no number: {:?}", word.chars().take(40).collect::<String>()));
        word.parse::<f32>().ok().filter(|number| number.is_finite()).ok_or_else(fault)
    }

    /// A count of angles from 1 to [`MAX_ANGLES`].
    pub(super) fn count(&self, number: f32, what: &str) -> Result<usize, Fault> {
        let is_count = number >= 1.0 && number.fract() == 0.0 && number <= MAX_ANGLES as f32;
        let fault =
            || Fault::new(self.line, format!("{what} is {number}: a whole number from 1 to {MAX_ANGLES} is expected"));
        is_count.then_some(number as usize).ok_or_else(fault)
    }

    /// So many numbers.
    pub(super) fn numbers(&mut self, count: usize, what: &str) -> Result<Vec<f32>, Fault> {
        (0..count).map(|_| self.number(what)).collect()
    }
}
