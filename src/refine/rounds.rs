//! Rounds of indirect light on their way, with all that is read to trace them: nothing that changes meanwhile.

use super::work::GatheredLight;
use super::workers::Underway;
use crate::cache::gather::{self, GatherJob, Gathered, Learnt};
use crate::geom::bvh::Bvh;
use crate::light::context::SceneContext;
use crate::light::lights::Lights;
use crate::scene::Scene;
use std::sync::Arc;

/// The rounds of a batch on their way.
pub struct Rounds {
    /// Their jobs.
    pub underway: Underway<Traced, Gathered>,
    /// What will have changed.
    pub light: GatheredLight,
}

/// What is read to trace them.
pub struct Traced {
    /// The scene.
    pub scene: Arc<Scene>,
    /// Its hierarchy.
    pub bvh: Arc<Bvh>,
    /// Its lights.
    pub lights: Arc<Lights>,
    /// What paths read of what others found.
    pub learnt: Learnt,
    /// The run's seed.
    pub seed: u64,
    /// The scene's ([`Scene::scale`]), scene units.
    pub scale: f32,
    /// The jobs.
    pub jobs: Vec<GatherJob>,
}

impl Traced {
    /// Does a job, by its number.
    pub fn gather(&self, job: usize) -> Gathered {
        let context = SceneContext::new(&self.scene, &self.bvh, &self.lights, self.seed, self.scale);
        let mut gathered = Gathered::default();
        gather::gather(&context, &self.learnt, &self.jobs[job], &mut gathered);
        gathered
    }
}
