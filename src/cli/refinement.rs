//! What `compare` refines, as the engine takes it.

use super::args::CompareArgs;
use super::setup::{SHADOW_AREA, SHADOW_PIXELS, TOLERANCE};
use crate::estimate::hemisphere::Method;
use crate::light::lights::MAX_LIGHT_GROUPS;
use crate::refine::options::{Options, Priority};
use crate::scene::Scene;

/// The options of `compare`: those of `render` by default.
#[must_use]
pub fn options_of_compare(args: &CompareArgs, scene: &Scene) -> Options {
    Options {
        seed: args.recording.seed,
        indirect: !args.recording.direct_only,
        filter: true,
        hemisphere: Method::Stratified,
        max_light_groups: MAX_LIGHT_GROUPS,
        priority: Priority::Error,
        min_pixels: 3.0,
        counted: true,
        contrast: 0.02,
        shadow_size: scene.scale() * SHADOW_PIXELS / args.size.width.max(args.size.height) as f32,
        shadow_pixels: SHADOW_AREA,
        white: (-scene.display.exposure).exp2(),
        tolerance: TOLERANCE,
    }
}
