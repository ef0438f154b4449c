//! How a command ended, as its exit status tells.

use super::interrupt;

/// How a command that met no error ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// What was asked is done.
    Done,
    /// What was asked is done, and a limit was exceeded.
    LimitExceeded,
    /// Ended early by a signal; the outputs hold what there was.
    Interrupted,
}

impl Outcome {
    /// The process exit status.
    #[must_use]
    pub const fn exit_status(self) -> u8 {
        match self {
            Self::Done => 0,
            Self::LimitExceeded => 1,
            Self::Interrupted => interrupt::EXIT_STATUS,
        }
    }
}
