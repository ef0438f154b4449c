//! What the summary of a run, and its trace, say of its session.

use super::Session;
use super::options::{Options, thread_count};
use super::totals::Totals;
use crate::log::summary::{Memory, Summary};
use crate::refine::update::MemoryStats;
use crate::system;
use crate::trace;
use crate::vk::Device;
use std::time::Instant;

impl Totals {
    /// Fills in device, memory, rays and clocks up to now of a process that was started at `start`.
    pub fn summarise(&self, summary: &mut Summary, device: &Device, options: &Options, start: Instant) {
        let (report, memory_on_device) = (device.report(), device.memory_bytes());
        let Self { frames, ahead, engine, elapsed, .. } = *self;
        let rate = |seconds: f64| (seconds > 0.0).then(|| engine.rays as f64 / seconds);
        summary.device.clone_from(&report.name);
        summary.driver.clone_from(&report.driver);
        summary.formats = serde_json::to_value(&report.formats).unwrap_or_default();
        summary.seed = options.seed;
        summary.threads = thread_count(options.threads);
        summary.size = [options.size.width, options.size.height];
        self.clocks(summary, start);
        let MemoryStats { budget, held, parts, free, evicted, coarsened, spilled, paged_in, file_bytes, .. } =
            engine.memory;
        summary.memory = Memory {
            triangles: engine.triangles,
            cache_bytes: engine.cache_bytes,
            budget,
            held,
            parts: parts.into_iter().map(|(part, bytes)| (part.to_owned(), bytes as u64)).collect(),
            free,
            evicted_faces: evicted,
            coarsened,
            spilled_clusters: spilled,
            paged_in_clusters: paged_in,
            page_file_bytes: file_bytes,
            device_bytes: memory_on_device,
            peak_bytes: system::peak_memory(),
        };
        summary.frames = frames;
        summary.ahead = ahead;
        summary.rays = engine.rays;
        summary.rays_per_second = rate(elapsed.as_secs_f64());
        summary.rays_per_cpu_second = rate(engine.cpu_seconds);
    }

    /// Fills in when frames were there, and the end, which is now.
    fn clocks(&self, summary: &mut Summary, start: Instant) {
        let Self { first_picture, lit_picture, complete_picture, last_picture, engine, .. } = self;
        let (times, cpu) = (&mut summary.times, &mut summary.cpu);
        for (moment, wall, cpu) in [
            (first_picture, &mut times.first_frame, &mut cpu.first_frame),
            (lit_picture, &mut times.lit_frame, &mut cpu.lit_frame),
            (complete_picture, &mut times.complete_frame, &mut cpu.complete_frame),
            (last_picture, &mut times.last_frame, &mut cpu.last_frame),
        ] {
            *wall = moment.map(|moment| moment.at.duration_since(start).as_secs_f64());
            *cpu = moment.and_then(|moment| moment.cpu_seconds);
        }
        times.total = Some(start.elapsed().as_secs_f64());
        cpu.total = system::cpu_seconds();
        cpu.light = engine.cpu_seconds;
    }
}

impl Session {
    /// Notes what grows, where a trace is recorded.
    pub(super) fn count(&self) {
        trace::counter("rays", self.stats.rays as f64);
        trace::counter("vertices", self.stats.vertices as f64);
        trace::counter("memory, MiB", self.memory_bytes() as f64 / f64::from(1 << 20));
    }
}
