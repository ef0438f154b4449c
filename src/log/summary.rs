//! The run summary beside the frame log: what ran, on what, how long each part took.

use crate::error::Result;
use crate::image::atomic;
use serde::{Deserialize, Serialize};
use std::io;
use std::path::{Path, PathBuf};

/// Everything about a run that is not a frame. Written as JSON with these names.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Summary {
    /// The command line, an element an argument.
    pub command: Vec<String>,
    /// Version of the program.
    pub version: &'static str,
    /// Name of the Vulkan device.
    pub device: String,
    /// Its driver and the driver's version.
    pub driver: String,
    /// Chosen format of each image, by the image's name.
    pub formats: serde_json::Value,
    /// Seed of all random choices.
    pub seed: u64,
    /// Threads that traced rays.
    pub threads: usize,
    /// Image size in pixels.
    pub size: [u32; 2],
    /// The point of the scene's files that the scene was moved from: zero unless it lies far from the origin.
    pub origin: [f64; 3],
    /// When each part was done.
    pub times: Times,
    /// CPU time by then.
    pub cpu: CpuTimes,
    /// Memory at the end.
    pub memory: Memory,
    /// Bytes that the light of the largest view was forecast to take, refined to the end.
    pub memory_forecast: u64,
    /// Frames drawn.
    pub frames: u64,
    /// Pictures made before the engine had answered a camera move.
    pub ahead: AheadPictures,
    /// Rays traced.
    pub rays: u64,
    /// Rays a second, from the first frame to the end; `null` if no frame was drawn.
    pub rays_per_second: Option<f64>,
    /// Rays per second of CPU time spent on light, all threads together; `null` if none was spent.
    pub rays_per_cpu_second: Option<f64>,
    /// Light that is kept from one run to the next; `null` without `--cache-dir`.
    pub kept: Option<KeptLight>,
    /// What ended the run: a budget's name, `converged`, or `interrupted`.
    pub ended_by: Option<String>,
    /// What is drawn by a simpler model than the scene asks for.
    pub stand_ins: Vec<String>,
    /// Warnings given during the run.
    pub warnings: Vec<String>,
}

/// What became of light that is kept from one run to the next.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct KeptLight {
    /// Blocks of an earlier run that were taken in.
    pub reused_blocks: u64,
    /// Their bytes.
    pub reused_bytes: u64,
    /// Blocks that this run saved, each as often as it was.
    pub saved_blocks: u64,
    /// Their bytes.
    pub saved_bytes: u64,
    /// Blocks that were damaged, and computed anew.
    pub damaged_blocks: u64,
}

impl KeptLight {
    /// One line for the user.
    #[must_use]
    pub fn line(&self) -> String {
        let mebibytes = |bytes: u64| bytes as f64 / f64::from(1 << 20);
        let Self { reused_blocks, reused_bytes, saved_blocks, saved_bytes, damaged_blocks } = *self;
        let damaged = if damaged_blocks > 0 { format!(", {damaged_blocks} damaged") } else { String::new() };
        format!(
            "kept light: {reused_blocks} blocks ({:.1} MiB) of earlier runs used{damaged}, {saved_blocks} ({:.1} MiB) saved",
            mebibytes(reused_bytes),
            mebibytes(saved_bytes)
        )
    }
}

/// Durations of the parts of the start, seconds; `null` for a part that was not reached.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Times {
    /// Reading the scene.
    pub load: Option<f64>,
    /// Building the BVH.
    pub bvh: Option<f64>,
    /// Opening the Vulkan device.
    pub device: Option<f64>,
    /// Building the pipelines.
    pub pipelines: Option<f64>,
    /// From the start of the process to the first frame combined.
    pub first_frame: Option<f64>,
    /// From the start of the process to the first frame after the first light was found.
    pub lit_frame: Option<f64>,
    /// From the start of the process to the first frame in which every visible vertex has a value.
    pub complete_frame: Option<f64>,
    /// From the start of the process to the last frame: images are written after it.
    pub last_frame: Option<f64>,
    /// From the start of the process to the end.
    pub total: Option<f64>,
}

/// CPU seconds of the process, all threads together, from its start; `null` where the system does not tell or what was not reached.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CpuTimes {
    /// To the frames of [`Times`] of the same names.
    pub first_frame: Option<f64>,
    /// To the first with light.
    pub lit_frame: Option<f64>,
    /// To the first complete one.
    pub complete_frame: Option<f64>,
    /// To the last.
    pub last_frame: Option<f64>,
    /// To the end.
    pub total: Option<f64>,
    /// Of the light engine, its own thread and those that trace, as the engine counts.
    pub light: f64,
    /// Of all threads by what they do.
    pub threads: Option<ThreadTimes>,
}

/// CPU seconds of threads by what they do, as long as there is an engine.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ThreadTimes {
    /// Jobs that the engine hands out: rays traced, leaves judged; on the threads that do nothing else, and on its own.
    pub tracing: f64,
    /// The engine's own thread, but for its share of those.
    pub engine: f64,
    /// The thread that loads the scene and drives the renderer, and its pool, which builds a part of the ray hierarchy.
    pub main: f64,
    /// All others that live to the end: those of the device's driver, which is the rasteriser where the device is the CPU.
    pub rasteriser: f64,
    /// Threads that have ended: hierarchy, device and pipelines.
    pub ended: f64,
}

/// Pictures of views that the engine had not answered yet.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct AheadPictures {
    /// Those with specular luminance of an earlier view.
    pub stale_specular: u64,
    /// Those with faces that show light of others near by.
    pub filled: u64,
}

/// Memory at the end.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Memory {
    /// Triangles that are drawn: the leaves of the hierarchy over the scene's, and what mends hanging nodes.
    pub triangles: u64,
    /// Bytes held by the light cache and the tables of the view, the queue and the publisher.
    pub cache_bytes: u64,
    /// Bytes that the light may take; 0 without a limit.
    pub budget: u64,
    /// Bytes that it takes as the limit counts them: with what a renderer holds of its slots and triangles.
    pub held: u64,
    /// What it takes them for.
    pub parts: std::collections::BTreeMap<String, u64>,
    /// Bytes of that which were given back and wait to be used again.
    pub free: u64,
    /// Faces that were evicted, and splits that were undone, for want of memory.
    pub evicted_faces: u64,
    /// See [`Self::evicted_faces`].
    pub coarsened: u64,
    /// Clusters of faces that were written to the page file, and those that were read back.
    pub spilled_clusters: u64,
    /// See [`Self::spilled_clusters`].
    pub paged_in_clusters: u64,
    /// Bytes of the page file.
    pub page_file_bytes: u64,
    /// Bytes held on the device.
    pub device_bytes: u64,
    /// The most bytes that the process held at once; `null` where the system does not tell.
    pub peak_bytes: Option<u64>,
}

impl Summary {
    /// A summary of this program, run now, to be filled.
    #[must_use]
    pub fn of_this_run() -> Self {
        Self {
            command: std::env::args_os().map(|a| a.to_string_lossy().into_owned()).collect(),
            version: env!("CARGO_PKG_VERSION"),
            ..Self::default()
        }
    }

    /// Where the summary of a frame log goes: `F.json` for `F.csv`.
    #[must_use]
    pub fn path_beside(log: &Path) -> PathBuf {
        log.with_extension("json")
    }

    /// One line for the user: what was done in how much time, and why it ended.
    #[must_use]
    pub fn line(&self, estimated_error: Option<f32>) -> String {
        let ended = self.ended_by.as_deref().unwrap_or("done");
        let total = self.times.total.unwrap_or(0.0);
        let error = estimated_error.map_or_else(String::new, |e| format!(", estimated error {:.2} %", e * 100.0));
        format!("{total:.2} s, {} frames, {} rays{error} ({ended})", self.frames, self.rays)
    }

    /// What `-v` adds: the device and where the time went.
    #[must_use]
    pub fn details(&self) -> Vec<String> {
        let seconds = |name: &str, time: Option<f64>| time.map(|t| format!("{name} {t:.3} s"));
        let Times { load, bvh, device, pipelines, first_frame, lit_frame, complete_frame, .. } = self.times;
        let parts = [
            seconds("load", load),
            seconds("BVH", bvh),
            seconds("device", device),
            seconds("pipelines", pipelines),
            seconds("first frame at", first_frame),
            seconds("light at", lit_frame),
            seconds("complete frame at", complete_frame),
        ];
        let rate = self.rays_per_cpu_second.map(|r| format!("{:.2} M rays per CPU second", r * 1e-6));
        let times: Vec<String> = parts.into_iter().flatten().chain(rate).collect();
        let mib = |bytes: u64| bytes.div_ceil(1 << 20);
        let [held, forecast, budget] = [self.memory.held, self.memory_forecast, self.memory.budget].map(mib);
        let memory = format!("light takes {held} MiB, {forecast} MiB were forecast, --memory {budget}");
        vec![format!("{}, {}", self.device, self.driver), times.join(", "), memory]
    }

    /// Writes the summary.
    ///
    /// # Errors
    /// [`crate::error::Error::Io`] naming the file; an old one is then untouched.
    pub fn write(&self, path: &Path) -> Result<()> {
        let mut text = serde_json::to_vec_pretty(self).map_err(|e| crate::error::Error::Internal(e.to_string()))?;
        text.push(b'\n');
        atomic::write(path, |file| io::Write::write_all(file, &text))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_json_holds_what_the_interface_names() {
        let folder = tempfile::tempdir().expect("folder");
        let path = Summary::path_beside(&folder.path().join("frames.csv"));
        assert!(path.ends_with("frames.json"));
        let mut summary =
            Summary { device: "llvmpipe".into(), seed: u64::MAX, size: [64, 48], ..Summary::of_this_run() };
        summary.times.load = Some(0.25);
        summary.warnings.push("a \"quoted\"\nwarning".into());
        summary.write(&path).expect("written");
        let json: serde_json::Value = serde_json::from_slice(&std::fs::read(&path).expect("file")).expect("JSON");
        for key in [
            "command",
            "version",
            "device",
            "driver",
            "formats",
            "times",
            "cpu",
            "memory",
            "rays_per_second",
            "stand_ins",
            "warnings",
        ] {
            assert!(json.get(key).is_some(), "{key}");
        }
        assert_eq!(json["seed"], u64::MAX);
        assert_eq!(json["times"]["load"], 0.25);
        assert!(json["times"]["bvh"].is_null());
        assert!(json["formats"].is_null(), "no device was opened");
        assert_eq!(json["warnings"][0], "a \"quoted\"\nwarning");
    }
}
