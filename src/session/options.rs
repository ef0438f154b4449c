//! What a run is asked for, as plain values. The command line's defaults are the ones here.

use super::budget::Budget;
use super::light_engine::Pace;
use crate::error::Result;
use crate::estimate::hemisphere::Method;
use crate::light::lights::MAX_LIGHT_GROUPS;
use crate::pass::{Depth, DepthFormat, DepthOrder, RendererOptions, UpdateMode};
use crate::refine::options::{Options as EngineOptions, Pieces, Priority};
use crate::scene::camera::ImageSize;
use crate::scene::{Display, Scene};
use crate::store::Store;
use crate::system::available_memory;
use crate::vk::Device;
use std::sync::Arc;
use std::time::Duration;

/// Options of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Image size, pixels.
    pub size: ImageSize,
    /// How images are displayed; `None` as the scene says.
    pub display: Option<Display>,
    /// The Vulkan device, by number or part of its name; `None` for the fastest kind.
    pub device: Option<String>,
    /// Threads that trace rays; `None` for all cores.
    pub threads: Option<u32>,
    /// Seed of all random choices.
    pub seed: u64,
    /// Whether the work between two frames goes by clock or by rays.
    pub pace: Pace,
    /// What is refined, and how far.
    pub refinement: Refinement,
    /// How changed lighting is redrawn.
    pub update: UpdateMode,
    /// Format of depth images; `None` for the best that the device has with a stencil.
    pub depth_format: Option<DepthFormat>,
    /// Which end of the range of depths is near.
    pub depth_order: DepthOrder,
    /// How the pixels of drawn triangles are counted.
    pub pixel_counts: PixelCounts,
    /// When the first frame of a new view is drawn.
    pub moves: Moves,
    /// Time between two frames that make a picture while the camera is still; `None` as [`Self::frames_on`] the device.
    pub refresh: Option<Duration>,
    /// Sub-pixel redraws that a written image is the mean of, ≥ 1: what any of them sees is lit.
    pub redraws: u32,
    /// Bytes that the light engine may hold at most, if there is a limit.
    pub memory: Option<u64>,
    /// When the run ends.
    pub budget: Budget,
    /// Frames in which the device is lost on purpose.
    pub lose_device_at: Vec<u64>,
    /// Where light is kept from one run to the next, if it is.
    pub store: Option<Arc<Store>>,
}

impl Options {
    /// Default size.
    pub const SIZE: ImageSize = ImageSize { width: 1024, height: 768 };
    /// Time between two pictures on a graphics card.
    const REFRESH: Duration = Duration::from_millis(40);
}

impl Default for Options {
    /// The defaults of `render`: quality normal, until the estimated error is 1 %.
    fn default() -> Self {
        Self {
            size: Self::SIZE,
            display: None,
            device: None,
            threads: None,
            seed: 0,
            pace: Pace::Free,
            refinement: Refinement::default(),
            update: UpdateMode::default(),
            depth_format: None,
            depth_order: DepthOrder::default(),
            pixel_counts: PixelCounts::default(),
            moves: Moves::default(),
            refresh: None,
            redraws: 1,
            memory: None,
            budget: Budget::default().or_error(Quality::default().error()),
            lose_device_at: Vec::new(),
            store: None,
        }
    }
}

/// What is refined, and how far.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Refinement {
    /// Whether light that bounces is computed, too.
    pub indirect: bool,
    /// Whether indirect light that is shown leans on neighbours while rays are few.
    pub filter: bool,
    /// How the directions of indirect light are chosen.
    pub hemisphere: Method,
    /// Lights at most whose visibility is kept each by itself; of more, small ones near each other share a light group.
    pub max_light_groups: u32,
    /// Which triangle is split next.
    pub priority: Priority,
    /// Where refinement stops.
    pub thresholds: Thresholds,
    /// Size of the smallest shadow that must not be missed, scene units; `None` goes by [`Thresholds::shadow_pixels`].
    pub shadow_size: Option<f32>,
    /// Pieces of the engine that are taken out, to measure what they are worth.
    pub without: Pieces,
}

impl Default for Refinement {
    fn default() -> Self {
        Self {
            indirect: true,
            filter: true,
            hemisphere: Method::Stratified,
            max_light_groups: MAX_LIGHT_GROUPS as u32,
            priority: Priority::default(),
            thresholds: Quality::default().thresholds(),
            shadow_size: None,
            without: Pieces::default(),
        }
    }
}

/// Where refinement stops.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Thresholds {
    /// Michelson contrast along an edge that counts as a discontinuity (with [`Priority::Random`]).
    pub contrast: f32,
    /// Size of the smallest shadow that must not be missed, pixels.
    pub shadow_pixels: f32,
    /// Triangles that cover no more pixels are not split.
    pub min_pixels: f32,
    /// Error of a pixel against the image's mean at which refinement stops.
    pub tolerance: f32,
}

/// A preset of [`Thresholds`], and of the error that ends a run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Quality {
    /// Coarse and quick, for looks at a scene that changes.
    Draft,
    /// What is good for most pictures.
    #[default]
    Normal,
    /// Fine and slow, down to a pixel.
    Final,
}

impl Quality {
    /// All presets with the names that options use.
    pub const NAMES: [(&'static str, Self); 3] =
        [("draft", Self::Draft), ("normal", Self::Normal), ("final", Self::Final)];

    /// The table of presets. Tolerances are rungs of the engine's ladder, which halves them from 1e-3 on. The error is one that the
    /// thresholds allow where geometry is dense: triangles of few pixels leave some percent.
    const fn row(self) -> (Thresholds, f32) {
        let (contrast, shadow_pixels, min_pixels, tolerance, error) = match self {
            //             contrast  shadow  triangle  tolerance  error
            Self::Draft => (0.05, 24.0, 6.0, 1e-3, 0.05),
            Self::Normal => (0.02, 12.0, 3.0, 2.5e-4, 0.01),
            Self::Final => (0.01, 6.0, 1.0, 6.25e-5, 0.004),
        };
        (Thresholds { contrast, shadow_pixels, min_pixels, tolerance }, error)
    }

    /// Where refinement stops.
    #[must_use]
    pub const fn thresholds(self) -> Thresholds {
        self.row().0
    }

    /// Estimated error of the image that ends a run without other limits: finer light takes many times longer and is hardly seen.
    #[must_use]
    pub const fn error(self) -> f32 {
        self.row().1
    }

    /// Its name.
    #[must_use]
    pub fn name(self) -> &'static str {
        Self::NAMES.iter().find(|(_, quality)| *quality == self).map_or("", |(name, _)| name)
    }
}

/// When frames are drawn while the camera is still.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Frames {
    /// Whenever something has arrived, and a picture in this time.
    Every(Duration),
    /// Where the device is the CPU that traces: so that they take at most a tenth of the time.
    Seldom,
}

/// When the first frame of a new view is drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Moves {
    /// Once the engine has answered: it shows all of the view.
    #[default]
    WhenAnswered,
    /// At once, where the engine works at a free pace on a thread of its own: exact geometry in the light that the device has. Faces that
    /// nothing is known of show light of others near by, and highlights lag by two pictures at most.
    AtOnce,
}

/// How the pixels of drawn triangles are counted, which steers refinement.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PixelCounts {
    /// By the engine: pixels of the image of face ids, sorted among the triangles as these are split.
    #[default]
    Image,
    /// The largest changed ones, by occlusion queries.
    Query,
    /// The changed ones as they are drawn, by counters.
    Atomic,
    /// Not at all.
    Off,
}

impl PixelCounts {
    /// As asked, or from the image where the device's queries are not exact.
    #[must_use]
    pub fn on(self, device: &Device) -> Self {
        if self == Self::Query && !device.report().precise_queries { Self::Image } else { self }
    }
}

/// Bytes that the light engine may hold: as asked, or half of what is free; no limit where the system does not tell.
#[must_use]
pub fn memory_budget(asked: Option<u64>) -> Option<u64> {
    asked.or_else(|| available_memory().map(|free| free / 2))
}

/// Number of threads: as asked, or as many as the machine can run at once.
#[must_use]
pub fn thread_count(asked: Option<u32>) -> usize {
    let available = || std::thread::available_parallelism().map_or(1, usize::from);
    asked.map_or_else(available, |n| n as usize)
}

impl Options {
    /// How images of a scene are displayed.
    #[must_use]
    pub fn display_of(&self, scene: &Scene) -> Display {
        self.display.unwrap_or(scene.display)
    }

    /// What the engine is made with.
    #[must_use]
    pub fn engine_options(&self, scene: &Scene) -> EngineOptions {
        let Refinement { indirect, filter, hemisphere, max_light_groups, priority, thresholds, shadow_size, without } =
            self.refinement;
        let Thresholds { contrast, shadow_pixels, min_pixels, tolerance } = thresholds;
        let image = self.size.width.max(self.size.height) as f32;
        EngineOptions {
            seed: self.seed,
            indirect,
            filter,
            listed: self.pixel_counts == PixelCounts::Image,
            hemisphere,
            max_light_groups: max_light_groups as usize,
            priority,
            min_pixels,
            contrast,
            // What covers a few pixels where the whole scene fills the image; nearer to the eye, what does so there.
            shadow_size: shadow_size.unwrap_or(scene.scale() * shadow_pixels / image),
            // The largest leaf that may hide a shadow: half a square of that size.
            shadow_pixels: shadow_size.map_or(shadow_pixels * shadow_pixels / 2.0, |_| f32::INFINITY),
            white: (-self.display_of(scene).exposure).exp2(),
            tolerance,
            without,
        }
    }

    /// When frames are drawn while the camera is still: by the clock, too, where a number of frames ends the run, or where
    /// it is the draws that count pixels.
    #[must_use]
    pub fn frames_on(&self, device: &Device) -> Frames {
        match self.refresh {
            Some(refresh) => Frames::Every(refresh),
            None if device.report().is_cpu() && self.needs_no_frames() => Frames::Seldom,
            None => Frames::Every(Self::REFRESH),
        }
    }

    /// Whether nothing but the eye misses frames that are not drawn.
    fn needs_no_frames(&self) -> bool {
        let draws_count = matches!(self.pixel_counts, PixelCounts::Query | PixelCounts::Atomic);
        let somebody_looks = self.moves == Moves::AtOnce;
        self.pace == Pace::Free && self.budget.frames.is_none() && !draws_count && !somebody_looks
    }

    /// What the renderer is made with on a device: `id` is what the stencil modes fall back to.
    ///
    /// # Errors
    /// [`crate::error::Error::NoDevice`] if the device lacks the depth format.
    pub fn renderer_options(&self, device: &Device) -> Result<RendererOptions> {
        let depth = Depth::new(device, self.depth_format, self.depth_order)?;
        let modes = if self.update == UpdateMode::Id { vec![self.update] } else { vec![self.update, UpdateMode::Id] };
        let atomic_counts = self.pixel_counts == PixelCounts::Atomic;
        let tailored = self.moves == Moves::AtOnce;
        Ok(RendererOptions { depth, modes, atomic_counts, tailored, ..RendererOptions::new(device)? })
    }
}

#[cfg(test)]
mod tests {
    use super::super::light_engine::Batches;
    use super::*;

    #[test]
    fn presets_get_finer_and_normal_is_the_default() {
        let [draft, normal, fine] = Quality::NAMES.map(|(_, quality)| quality.thresholds());
        for (coarse, fine) in [(draft, normal), (normal, fine)] {
            assert!(coarse.contrast > fine.contrast && coarse.shadow_pixels > fine.shadow_pixels);
            assert!(coarse.min_pixels > fine.min_pixels && coarse.tolerance > fine.tolerance);
        }
        let errors = Quality::NAMES.map(|(_, quality)| quality.error());
        assert!(errors[0] > errors[1] && errors[1] > errors[2], "{errors:?}");
        let options = Options::default();
        assert_eq!((options.refinement.thresholds, options.budget.error), (normal, Some(0.01)));
        assert_eq!(normal, Thresholds { contrast: 0.02, shadow_pixels: 12.0, min_pixels: 3.0, tolerance: 2.5e-4 });
        assert_eq!(Quality::NAMES.map(|(_, quality)| quality.name()), ["draft", "normal", "final"]);
    }

    #[test]
    fn a_shadow_size_in_scene_units_overrides_the_one_in_pixels() {
        let scene = Scene::default();
        let mut options = Options::default();
        let by_pixels = options.engine_options(&scene);
        assert_eq!(by_pixels.shadow_pixels, 72.0);
        assert_eq!(by_pixels.shadow_size, scene.scale() * 12.0 / 1024.0);
        options.refinement.shadow_size = Some(0.5);
        let by_size = options.engine_options(&scene);
        assert_eq!((by_size.shadow_size, by_size.shadow_pixels), (0.5, f32::INFINITY));
    }

    #[test]
    fn frames_are_needed_where_they_are_counted_or_count() {
        let of = |pixel_counts, frames, pace| {
            let budget = Budget { frames, ..Budget::default() };
            Options { pixel_counts, budget, pace, ..Options::default() }.needs_no_frames()
        };
        use PixelCounts::{Atomic, Image, Off, Query};
        assert_eq!([Image, Query, Atomic, Off].map(|how| of(how, None, Pace::Free)), [true, false, false, true]);
        assert!(!of(Image, Some(9), Pace::Free) && !of(Image, None, Pace::Fixed(Batches::A_FRAME)));
        assert!(!Options { moves: Moves::AtOnce, ..Options::default() }.needs_no_frames());
    }

    #[test]
    fn the_engine_counts_pixels_where_the_gpu_does_not() {
        let listed =
            |pixel_counts| Options { pixel_counts, ..Options::default() }.engine_options(&Scene::default()).listed;
        use PixelCounts::{Atomic, Image, Off, Query};
        assert_eq!([Image, Query, Atomic, Off].map(listed), [true, false, false, false]);
    }
}
