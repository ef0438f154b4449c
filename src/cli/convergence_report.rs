//! What `bench convergence` found: table, JSON, plot.

use super::args::bench::ConvergenceArgs;
use super::args::thread_count;
use crate::bench::convergence::{Curve, PathTracer, Point};
use crate::bench::plot::{Line, log_log};
use crate::bench::reference_pixels::ReferencePixels;
use crate::error::{Error, Result};
use crate::scene::Scene;
use serde::Serialize;
use std::path::Path;

/// relMSE to which the times of both are given.
const TARGETS: [f64; 3] = [1e-2, 5e-3, 1e-3];
/// Errors below this times the reference's own are doubtful.
const DOUBTFUL: f64 = 5.0;
/// The table has a row for these times and their tenfolds.
const ROWS: [f64; 2] = [1.0, 3.0];

/// relMSE to which the times of both are given.
pub fn targets() -> impl Iterator<Item = f64> {
    TARGETS.into_iter()
}

/// All that was found; the JSON of `--json` has these names.
#[derive(Clone, Debug, Serialize)]
pub struct Document {
    scene: String,
    reference: String,
    size: [u32; 2],
    triangles: usize,
    device: String,
    threads: usize,
    seed: u64,
    /// Whether indirect light was shown filtered.
    filtered: bool,
    /// Pixels compared.
    compared: usize,
    /// relMSE that the reference's own noise makes, by its variance; taken off all errors.
    own_relmse: f64,
    engine: Curve,
    path_tracer: PathTracer,
    targets: Vec<Target>,
}

/// CPU time to an error.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Target {
    relmse: f64,
    /// `null` if it was not reached.
    engine_cpu_seconds: Option<f64>,
    path_tracer_cpu_seconds: Option<f64>,
    /// Whether the path tracer's time lies beyond what was traced, by the law of independent samples.
    by_law: bool,
    /// Path tracer over engine.
    ratio: Option<f64>,
    /// Whether the reference is too noisy to be sure.
    doubtful: bool,
}

impl Document {
    /// Puts together what was measured.
    #[must_use]
    pub fn new(
        args: &ConvergenceArgs,
        scene: &Scene,
        device: &str,
        reference_pixels: &ReferencePixels,
        engine: Curve,
        path_tracer: PathTracer,
    ) -> Self {
        let own_relmse = reference_pixels.own_relmse();
        let target = |relmse: f64| {
            let (ours, theirs) = (engine.reaches(relmse), path_tracer.reaches(relmse));
            Target {
                relmse,
                engine_cpu_seconds: ours,
                path_tracer_cpu_seconds: theirs.map(|(seconds, _)| seconds),
                by_law: theirs.is_some_and(|(_, by_law)| by_law),
                ratio: ours.zip(theirs).map(|(ours, (theirs, _))| theirs / ours),
                doubtful: relmse < DOUBTFUL * own_relmse,
            }
        };
        Self {
            scene: args.scene.display().to_string(),
            reference: args.reference.display().to_string(),
            size: [reference_pixels.image().size.width, reference_pixels.image().size.height],
            triangles: scene.triangles.len(),
            device: device.to_owned(),
            threads: thread_count(args.cpu.threads),
            seed: args.cpu.seed,
            filtered: args.filtered,
            compared: reference_pixels.counted(),
            own_relmse,
            targets: TARGETS.into_iter().map(target).collect(),
            engine,
            path_tracer,
        }
    }

    /// As JSON, with a line end.
    ///
    /// # Errors
    /// [`Error::Internal`] if it cannot be written as JSON.
    pub fn json(&self) -> Result<String> {
        serde_json::to_string_pretty(self).map(|text| text + "\n").map_err(|e| Error::Internal(e.to_string()))
    }

    /// As tables.
    #[must_use]
    pub fn text(&self) -> String {
        let Self { scene, size: [width, height], triangles, compared, threads, seed, own_relmse, .. } = self;
        let filter = if self.filtered { "filtered" } else { "without filter" };
        let mut text = format!(
            "{scene}: {triangles} triangles, {width}x{height}, {compared} pixels compared, {filter}, {threads} threads, seed \
             {seed}\nthe reference's own relMSE {own_relmse:.1e} is taken off; ~ below {DOUBTFUL} times that\n\nlight engine\n     \
             CPU s        rays      relMSE      RMSE     FLIP  estimated  est./RMSE  path tracer's relMSE\n"
        );
        self.rows().for_each(|point| text += &self.row(point));
        text += &format!(
            "\npath tracer: {:.3} CPU s a sample of each pixel; error at {} pixels\n\n  relMSE   engine CPU s   path tracer CPU s   \
             ratio\n",
            self.path_tracer.cpu_seconds_a_pass, self.path_tracer.pixels
        );
        self.targets.iter().for_each(|target| text += &target.row());
        text + "  * beyond what was traced: error times time is constant\n"
    }

    /// The first point at or after each time of the table, and the last.
    fn rows(&self) -> impl Iterator<Item = &Point> {
        let points = &self.engine.points;
        let times = (-3..5).flat_map(|decade| ROWS.map(|t| t * 10_f64.powi(decade)));
        let mut rows: Vec<usize> = times
            .filter_map(|time| points.iter().position(|p| p.cpu_seconds >= time))
            .chain(points.len().checked_sub(1))
            .collect();
        rows.dedup();
        rows.into_iter().map(|i| &points[i])
    }

    fn row(&self, point: &Point) -> String {
        let Point { cpu_seconds, rays, relmse, rmse_over_mean, flip, estimated_error } = *point;
        let mark = |relmse: f64| if relmse < DOUBTFUL * self.own_relmse { "~" } else { " " };
        let error =
            |relmse: f64| if relmse > 0.0 { format!("{}{relmse:.2e}", mark(relmse)) } else { "noise".to_owned() };
        let percent = |value: f64| format!("{:.2} %", value * 100.0);
        let or_dash = |text: Option<String>| text.unwrap_or_else(|| "-".to_owned());
        let quotient = estimated_error.filter(|_| rmse_over_mean > 0.0).map(|e| format!("{:.2}", e / rmse_over_mean));
        format!(
            "  {cpu_seconds:>8.3}  {rays:>10}  {:>10}  {:>8}  {:>7}  {:>9}  {:>9}  {:>20}\n",
            error(relmse),
            if rmse_over_mean > 0.0 { percent(rmse_over_mean) } else { "noise".to_owned() },
            or_dash(flip.map(|f| format!("{f:.4}"))),
            or_dash(estimated_error.map(percent)),
            or_dash(quotient),
            or_dash(self.path_tracer.relmse_at(cpu_seconds).map(error)),
        )
    }

    /// Both curves and the reference's own noise, as SVG.
    #[must_use]
    pub fn plot(&self) -> String {
        let points = |curve: &Curve| curve.points.iter().map(|p| (p.cpu_seconds, p.relmse)).collect::<Vec<_>>();
        let all = || self.engine.points.iter().chain(&self.path_tracer.curve.points).map(|p| p.cpu_seconds);
        let ends = [all().fold(f64::INFINITY, f64::min), all().fold(0.0, f64::max)];
        let noise = ends.map(|x| (x, self.own_relmse)).to_vec();
        let lines = [
            Line { name: "light engine", points: points(&self.engine), colour: "#0b63a5", measured: true },
            Line { name: "path tracer", points: points(&self.path_tracer.curve), colour: "#c4451c", measured: true },
            Line { name: "reference's own noise", points: noise, colour: "#777777", measured: false },
        ];
        let name = Path::new(&self.scene).file_stem().unwrap_or_default().to_string_lossy();
        let title = format!("{name} {}x{}", self.size[0], self.size[1]);
        log_log(&title, ["CPU seconds", "relMSE, the reference's noise taken off"], &lines)
    }
}

impl Target {
    fn row(&self) -> String {
        let not_reached = || "not reached".to_owned();
        let engine = self.engine_cpu_seconds.map_or_else(not_reached, |s| format!("{s:.3}"));
        let law = if self.by_law { " *" } else { "  " };
        let tracer = self.path_tracer_cpu_seconds.map_or_else(not_reached, |s| format!("{s:.2}{law}"));
        let ratio = self.ratio.map_or_else(|| "-".to_owned(), |ratio| format!("{ratio:.1}"));
        let mark = if self.doubtful { "~" } else { " " };
        format!(" {mark}{:>7.0e}   {engine:>12}   {tracer:>17}   {ratio:>5}\n", self.relmse)
    }
}
