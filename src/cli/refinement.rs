//! What was typed about refinement, as the engine takes it.

use super::args::{CompareArgs, PixelCounts, RenderArgs};
use crate::estimate::hemisphere::Method;
use crate::refine::options::{Options, Priority};
use crate::scene::Scene;
use crate::scene::camera::ImageSize;

/// Default size of the smallest shadow wanted, pixels.
const SHADOW_PIXELS: f32 = 12.0;
/// Default pixels of the largest leaf that may hide a shadow: half a square of that size.
const SHADOW_AREA: f32 = SHADOW_PIXELS * SHADOW_PIXELS / 2.0;
/// Error of a pixel against the image's mean at which refinement ends.
const TOLERANCE: f32 = 2.5e-4;

/// The options of `render`.
#[must_use]
pub fn options(args: &RenderArgs, scene: &Scene) -> Options {
    let display = args.output.display(&scene.display);
    let refinement = &args.refinement;
    Options {
        seed: args.engine.seed,
        indirect: !refinement.direct_only,
        filter: !refinement.no_filter,
        hemisphere: refinement.hemisphere,
        priority: refinement.priority,
        min_pixels: refinement.min_pixels,
        counted: args.pixel_counts == PixelCounts::Histogram,
        contrast: refinement.contrast,
        shadow_size: refinement.shadow_size.unwrap_or_else(|| shadow_size(scene, args.scene.size)),
        shadow_pixels: refinement.shadow_size.map_or(SHADOW_AREA, |_| f32::INFINITY),
        white: (-display.exposure).exp2(),
        tolerance: TOLERANCE,
    }
}

/// What covers a few pixels where the whole scene fills the image; nearer to the eye, what does so there.
fn shadow_size(scene: &Scene, size: ImageSize) -> f32 {
    scene.diagonal() * SHADOW_PIXELS / size.width.max(size.height) as f32
}

/// The options of `compare`: those of `render` by default.
#[must_use]
pub fn options_of_compare(args: &CompareArgs, scene: &Scene) -> Options {
    Options {
        seed: args.recording.seed,
        indirect: !args.recording.direct_only,
        filter: true,
        hemisphere: Method::Stratified,
        priority: Priority::Error,
        min_pixels: 3.0,
        counted: true,
        contrast: 0.02,
        shadow_size: shadow_size(scene, args.size),
        shadow_pixels: SHADOW_AREA,
        white: (-scene.display.exposure).exp2(),
        tolerance: TOLERANCE,
    }
}
