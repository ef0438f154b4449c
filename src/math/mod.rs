//! Frames, sampling sequences, running statistics.
