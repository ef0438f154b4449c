//! Evaluation of reflection and emission.
