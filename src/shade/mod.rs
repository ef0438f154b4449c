//! Evaluation of reflection, and of light arriving without occlusion.

pub mod lights;
pub mod phong;
