//! Brute-force path tracer: no cache, no interpolation; what everything else is measured against.
//!
//! At each point of a path one light (all, where there are few) is sampled, and one direction by the reflection model; both
//! find area lights and are weighed against each other \[VG95\]. Paths end by Russian roulette alone, so the mean is that of
//! all bounces.

mod accumulator;
mod direct;
mod path;
mod progressive;
mod random;
mod settings;
mod surface;

pub use accumulator::{Accumulator, Pass, ReferenceImage, random_pixels};
pub use progressive::Progressive;
pub use settings::{Filter, Settings, Strategy, Transport};
