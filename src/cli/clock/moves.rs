//! What a camera move costs while the engine works: drawn at once, as for somebody who walks, not when the engine has answered.

use crate::bench::walk::walk;
use crate::cli::args::clock::ClockArgs;
use crate::cli::interrupt::{Signals, requested};
use crate::error::Result;
use crate::geom::bvh::Bvh;
use crate::pass::FrameStats;
use crate::refine::update::EngineStats;
use crate::scene::Scene;
use crate::scene::camera::Camera;
use crate::session::pictures::{Picture, Pictures};
use crate::session::{Budget, FrameReport, Moves, Opening, Options};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// What a move costs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Move {
    /// CPU milliseconds of the engine for the new view, all threads.
    pub engine_ms: f64,
    /// Milliseconds of the device for its first frame, the sum of its passes; `None` where the device does not tell.
    pub device_ms: Option<f64>,
    /// Wall-clock milliseconds from the move to its first picture.
    pub wall_ms: f64,
}

impl Move {
    /// By its first frame, and by what the engine has spent on the view once it has answered.
    fn new(report: &FrameReport, wall: Duration, answered: &EngineStats) -> Self {
        const MS: f64 = 1e3;
        Self {
            engine_ms: answered.view_cpu_seconds * MS,
            device_ms: device_ms(&report.passes),
            wall_ms: wall.as_secs_f64() * MS,
        }
    }
}

/// Milliseconds of all passes that ran.
fn device_ms(passes: &FrameStats) -> Option<f64> {
    let FrameStats { visibility_ms, colour_ms, luminance_ms, combine_ms, .. } = *passes;
    [visibility_ms, colour_ms, luminance_ms, combine_ms].into_iter().flatten().reduce(|sum, ms| sum + ms)
}

/// A walk through a scene.
pub struct Walk {
    scene: Arc<Scene>,
    bvh: Arc<Bvh>,
    pictures: Vec<Picture>,
}

impl Walk {
    /// The walk that the options ask for.
    ///
    /// # Errors
    /// What is wrong with the camera path.
    pub fn new(args: &ClockArgs, scene: &Arc<Scene>, camera: Camera) -> Result<Self> {
        let bvh = Arc::new(Bvh::build(scene));
        let of = u64::from(args.pictures);
        let pictures = match &args.camera_path {
            Some(path) => {
                let pictures = Pictures::new(scene, camera, Some(path), Some(of))?;
                (0..of).map(|index| pictures.picture(index, scene)).collect()
            }
            None => {
                let cameras = walk(scene, &bvh, &camera, args.pictures).into_iter().zip(0..);
                let picture = |(camera, index)| Picture { index, of, camera, lights: Vec::new(), on_path: true };
                cameras.map(picture).collect()
            }
        };
        Ok(Self { scene: Arc::clone(scene), bvh, pictures })
    }

    /// Walks, sharing out the rays among the pictures as `render` does; what each move but the first costs, `None` if it was broken off.
    ///
    /// # Errors
    /// No usable device, a lost device, or no memory.
    pub fn take(&self, args: &ClockArgs, seed: u64, goes_on: &dyn Fn(&Picture) -> bool) -> Result<Option<Vec<Move>>> {
        let options = Options {
            size: args.size,
            device: args.device.device.clone(),
            threads: args.cpu.threads,
            seed,
            moves: Moves::AtOnce,
            budget: Budget { rays: Some(args.rays), ..Budget::default() },
            ..Options::default()
        };
        let bvh = Arc::clone(&self.bvh);
        let mut session = Opening::start(&options)?.finish()?.session(&self.scene, move |_| bvh, &options)?;
        let mut moves = Vec::new();
        for picture in &self.pictures {
            let start = Instant::now();
            session.show(picture)?;
            let report = session.step(&mut Signals)?;
            let wall = start.elapsed();
            if report.ended_by.is_none() {
                session.run(&mut Signals)?;
            }
            moves.push(Move::new(&report, wall, &session.totals().engine));
            if !goes_on(picture) || requested() {
                return Ok(None);
            }
        }
        // The first waits for the engine to be made.
        moves.remove(0);
        Ok(Some(moves))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn passes_that_ran_add_up() {
        let passes = FrameStats { colour_ms: Some(2.0), combine_ms: Some(0.5), ..FrameStats::default() };
        assert_eq!((device_ms(&passes), device_ms(&FrameStats::default())), (Some(2.5), None));
    }
}
