//! Estimators: what is kept of light arriving at a point from one source, and how the light of a hemisphere is gathered.

pub mod hemisphere;
pub mod light_vector;
pub mod lobe_share;
pub mod penumbra;
pub mod stratification;
pub mod surface;
pub mod visibility;
