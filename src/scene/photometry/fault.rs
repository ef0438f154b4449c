//! What is wrong with a file of photometry.

/// Most angles of one kind: a step of 0.1° all round.
pub(super) const MAX_ANGLES: usize = 3601;

/// What is wrong with a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fault {
    /// Line, from 1.
    pub line: u32,
    /// What, and what to do.
    pub message: String,
}

impl Fault {
    pub(super) fn new(line: u32, message: impl Into<String>) -> Self {
        Self { line, message: message.into() }
    }
}
