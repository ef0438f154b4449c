//! What to sample next: vertices stage by stage, nearest and largest first.
//!
//! A vertex is visited with few rays before any other is visited with more, so that the first picture does not wait
//! for the last vertex's last ray.

use crate::cache::vertex::VertexId;
use crate::estimate::direct::{Job, LAST_STAGE, points_after};
use std::collections::VecDeque;

/// Visits waiting, by stage.
#[derive(Debug, Default)]
pub struct Queue {
    stages: [VecDeque<VertexId>; LAST_STAGE as usize + 1],
}

/// Rays a run of jobs should cost about: enough to be worth handing out, few enough to keep the frame loop served.
const RAYS_A_RUN: u32 = 4096;

impl Queue {
    /// Drops all waiting visits.
    pub fn clear(&mut self) {
        self.stages.iter_mut().for_each(VecDeque::clear);
    }

    /// Adds a visit behind those of its stage; ignored past the last stage.
    pub fn push(&mut self, vertex: VertexId, stage: u32) {
        if let Some(waiting) = self.stages.get_mut(stage as usize) {
            waiting.push_back(vertex);
        }
    }

    /// Takes the next run of jobs, all of one stage; empty when nothing waits.
    pub fn take(&mut self, lights: usize) -> Vec<Job> {
        let Some(stage) = self.stages.iter().position(|s| !s.is_empty()) else { return Vec::new() };
        let rays_a_job = points_after(stage as u32).min(256) * lights.clamp(1, 16) as u32;
        let count = (RAYS_A_RUN / rays_a_job).max(16) as usize;
        let waiting = &mut self.stages[stage];
        let count = count.min(waiting.len());
        waiting.drain(..count).map(|vertex| Job { vertex, stage: stage as u32 }).collect()
    }

    /// Whether nothing waits.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.stages.iter().all(VecDeque::is_empty)
    }

    /// Whether the first visits of all vertices are done: every visible vertex has a value.
    #[must_use]
    pub fn first_visits_done(&self) -> bool {
        self.stages[0].is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lower_stages_come_first_and_keep_their_order() {
        let mut queue = Queue::default();
        for (vertex, stage) in [(5, 1), (9, 0), (3, 0), (4, 1)] {
            queue.push(VertexId(vertex), stage);
        }
        let ids = |jobs: Vec<Job>| jobs.iter().map(|j| (j.vertex.0, j.stage)).collect::<Vec<_>>();
        assert_eq!(ids(queue.take(1)), [(9, 0), (3, 0)]);
        assert!(queue.first_visits_done());
        assert_eq!(ids(queue.take(1)), [(5, 1), (4, 1)]);
        assert!(queue.is_empty());
        queue.push(VertexId(1), LAST_STAGE + 1);
        assert!(queue.is_empty());
    }
}
