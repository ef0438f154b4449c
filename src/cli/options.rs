//! What was typed, as a session takes it.

use super::args::ablate::AblateArgs;
use super::args::bench::ConvergenceArgs;
use super::args::{BudgetArgs, CompareArgs, CpuArgs, DeviceArgs, ProbeArgs, RefinementArgs, RenderArgs, ViewArgs};
use crate::pass::UpdateMode;
use crate::scene::camera::ImageSize;
use crate::session::{Batches, Budget, Moves, Options, Pace, Refinement, Thresholds};
use std::time::Duration;

impl RenderArgs {
    /// The options of the run, but for how its images are displayed, which the scene has a say in.
    #[must_use]
    pub fn options(&self) -> Options {
        Options {
            size: self.scene.size,
            display: None,
            device: self.device.device.clone(),
            threads: self.engine.threads,
            seed: self.engine.seed,
            pace: if self.engine.deterministic { Pace::Fixed(Batches::A_FRAME) } else { Pace::Free },
            refinement: self.refinement.options(!self.no_filter),
            update: self.update,
            depth_format: self.depth.depth_format,
            depth_order: self.depth.depth,
            pixel_counts: self.pixel_counts,
            moves: Moves::WhenAnswered,
            refresh: self.refresh,
            redraws: self.output.aa,
            memory: self.memory.budget(),
            budget: self.limits(),
            lose_device_at: self.lose_device_at.clone(),
            store: None,
        }
    }

    /// The limits of the run, with the preset's error where there are none; frames are none for a picture of a path.
    fn limits(&self) -> Budget {
        let BudgetArgs { time, frames, rays, error } = self.budget;
        let frames = frames.filter(|_| self.camera_path.is_none());
        Budget { time, frames, rays, error }.or_error(self.refinement.quality.error())
    }
}

impl ProbeArgs {
    /// The options of the run: those of `render` for the same picture.
    #[must_use]
    pub fn options(&self) -> Options {
        let BudgetArgs { time, frames, rays, error } = self.budget;
        Options {
            size: self.scene.size,
            device: self.device.device.clone(),
            threads: self.engine.threads,
            seed: self.engine.seed,
            pace: if self.engine.deterministic { Pace::Fixed(Batches::A_FRAME) } else { Pace::Free },
            refinement: self.refinement.options(!self.no_filter),
            budget: Budget { time, frames, rays, error }.or_error(self.refinement.quality.error()),
            ..Options::default()
        }
    }
}

impl ViewArgs {
    /// The options of the run, which has no limits: fixed work a frame without a window. How pictures are displayed, the scene has
    /// a say in.
    #[must_use]
    pub fn options(&self) -> Options {
        let batches = Batches { rays: self.rays, most: self.rays, ..Batches::A_FRAME };
        Options {
            size: self.scene.size,
            device: self.device.device.clone(),
            threads: self.cpu.threads,
            seed: self.cpu.seed,
            pace: if self.headless { Pace::Fixed(batches) } else { Pace::Free },
            refinement: self.refinement.options(true),
            update: self.update,
            moves: Moves::AtOnce,
            // Every frame that is drawn is shown, and drawn when it is to be shown.
            refresh: Some(Duration::ZERO),
            memory: self.memory.budget(),
            budget: Budget::default(),
            lose_device_at: self.lose_device_at.clone(),
            ..Options::default()
        }
    }
}

impl ConvergenceArgs {
    /// The options of the engine's run.
    #[must_use]
    pub fn options(&self, size: ImageSize) -> Options {
        measured(size, &self.cpu, &self.device, self.refinement.options(self.filtered))
    }
}

impl AblateArgs {
    /// The options of the engine's runs with all pieces, of the first seed.
    #[must_use]
    pub fn options(&self, size: ImageSize) -> Options {
        measured(size, &self.cpu, &self.device, self.refinement.options(self.filtered))
    }
}

/// The options of a run that is measured: batches of fixed work, more between frames as rays add up, pictures when they are asked for.
fn measured(size: ImageSize, cpu: &CpuArgs, device: &DeviceArgs, refinement: Refinement) -> Options {
    // Pixels are counted as often as by `render`, a few times a second.
    let batches = Batches { rays: 20_000, most: 400_000, counts_lag: 0 };
    Options {
        size,
        device: device.device.clone(),
        threads: cpu.threads,
        seed: cpu.seed,
        pace: Pace::Fixed(batches),
        refinement,
        update: UpdateMode::Stencil,
        refresh: Some(Duration::MAX),
        budget: Budget::default(),
        ..Options::default()
    }
}

impl CompareArgs {
    /// The options of a recording: what `render` refines, an update of fixed work a frame.
    #[must_use]
    pub fn options(&self) -> Options {
        let rays = self.recording.rays;
        Options {
            size: self.size,
            threads: self.recording.threads,
            seed: self.recording.seed,
            pace: Pace::Fixed(Batches { rays, most: rays, counts_lag: 0 }),
            refinement: Refinement { indirect: !self.recording.direct_only, ..Refinement::default() },
            update: UpdateMode::Full,
            refresh: Some(Duration::MAX),
            budget: Budget::default(),
            ..Options::default()
        }
    }
}

impl RefinementArgs {
    /// The preset of `--quality`, but for what was typed; `filter` is another option of each command.
    #[must_use]
    pub fn options(&self, filter: bool) -> Refinement {
        let preset = self.quality.thresholds();
        Refinement {
            indirect: !self.direct_only,
            filter,
            hemisphere: self.hemisphere,
            max_light_groups: self.max_light_groups,
            priority: self.priority,
            thresholds: Thresholds {
                contrast: self.contrast.unwrap_or(preset.contrast),
                min_pixels: self.min_pixels.unwrap_or(preset.min_pixels),
                ..preset
            },
            shadow_size: self.shadow_size,
            without: self.without(),
        }
    }
}
