//! What `bench clock` found: figures over the runs, JSON, plot.

use super::moves::Move;
use super::renders::Timed;
use super::study::{Found, Subject};
use crate::bench::Figure;
use crate::bench::crossing::crossing;
use crate::bench::plot::{Line, log_log};
use crate::bench::reference_pixels::{Error as ImageError, ReferencePixels};
use crate::cli::args::clock::ClockArgs;
use crate::error::{Error, Result};
use crate::log::summary::{CpuTimes, ThreadTimes, Times};
use crate::session::thread_count;
use crate::system::Machine;
use serde::Serialize;

/// All that was found; the JSON of `--json` has these names. Figures are over the runs; `null` where a run does not tell.
#[derive(Clone, Debug, Serialize)]
pub struct Document {
    pub version: &'static str,
    pub machine: Machine,
    pub load_average_before: Option<f32>,
    pub load_average_after: Option<f32>,
    pub device: String,
    pub driver: String,
    pub threads: usize,
    /// The first seed, and how many runs of seeds from there on.
    pub seed: u64,
    pub runs: u64,
    /// Rays of a whole run and of a walk, and the size of their images.
    pub rays: u64,
    pub size: [u32; 2],
    pub scenes: Vec<SceneDocument>,
}

/// What was found in a scene.
#[derive(Clone, Debug, Serialize)]
pub struct SceneDocument {
    pub scene: String,
    pub triangles: usize,
    pub whole_run: WholeRun,
    /// `null` without a reference.
    pub errors: Option<Errors>,
    pub moves: Moves,
}

/// A run of so many rays, from the start of its process.
#[derive(Clone, Debug, Serialize)]
pub struct WholeRun {
    pub wall_seconds: Stages,
    pub cpu_seconds: Stages,
    /// CPU seconds as the light engine counts its own.
    pub light_cpu_seconds: Option<Figure>,
    /// Cores that the process keeps busy from the first light to the last frame.
    pub cores_refining: Option<Figure>,
    pub threads: Option<Threads>,
    pub memory: MemoryFigures,
}

/// Seconds from the start of the process to its frames, and to its end.
#[derive(Clone, Debug, Serialize)]
pub struct Stages {
    pub first_frame: Option<Figure>,
    pub lit_frame: Option<Figure>,
    pub complete_frame: Option<Figure>,
    pub last_frame: Option<Figure>,
    pub end: Option<Figure>,
}

/// CPU seconds by what threads do ([`ThreadTimes`]).
#[derive(Clone, Debug, Serialize)]
pub struct Threads {
    pub tracing: Figure,
    pub engine: Figure,
    pub main: Figure,
    pub rasteriser: Figure,
    pub ended: Figure,
    /// Tracing over all.
    pub tracing_share: Figure,
    /// The engine's own thread, its share of tracing left out, over that and tracing.
    pub serial_share: Figure,
}

/// Memory at the end.
#[derive(Clone, Debug, Serialize)]
pub struct MemoryFigures {
    pub triangles: Option<Figure>,
    pub bytes_a_triangle: Option<Figure>,
    pub cache_bytes: Option<Figure>,
    pub device_bytes: Option<Figure>,
    pub peak_bytes: Option<Figure>,
}

/// Errors by `render --time`, in the reference's size.
#[derive(Clone, Debug, Serialize)]
pub struct Errors {
    pub reference: String,
    pub size: [u32; 2],
    /// Pixels compared.
    pub compared: usize,
    /// relMSE that the reference's own noise makes, by its variance; taken off all errors.
    pub own_relmse: f64,
    pub points: Vec<Point>,
    pub targets: Vec<Target>,
}

/// Runs of one `--time`.
#[derive(Clone, Debug, Serialize)]
pub struct Point {
    pub time: f64,
    pub wall_seconds: Option<Figure>,
    pub cpu_seconds: Option<Figure>,
    pub light_cpu_seconds: Option<Figure>,
    pub relmse: Option<Figure>,
    /// Median of the mean of image − reference over the reference's mean.
    pub mean_shift: f64,
}

/// Error of a run over seconds, rising.
type Curve = Vec<(f64, f64)>;

/// Time to an error; `null` where more than half of the runs do not come so far.
#[derive(Clone, Debug, Serialize)]
pub struct Target {
    pub relmse: f64,
    pub wall_seconds: Option<Figure>,
    pub cpu_seconds: Option<Figure>,
    /// Whether a run was there in the shortest time already.
    pub at_most: bool,
}

/// What camera moves cost, milliseconds.
#[derive(Clone, Debug, Serialize)]
pub struct Moves {
    /// `null` for a round about the camera.
    pub camera_path: Option<String>,
    pub pictures: u32,
    /// CPU time of the engine, all threads.
    pub engine_ms: Option<Cost>,
    /// Time of the device for the frame after a move.
    pub device_ms: Option<Cost>,
    /// From the move to its picture.
    pub wall_ms: Option<Cost>,
}

/// Over the moves of a walk.
#[derive(Clone, Debug, Serialize)]
pub struct Cost {
    pub median: Figure,
    pub worst: Figure,
}

impl Document {
    /// Nothing measured yet.
    #[must_use]
    pub fn new(args: &ClockArgs, load_average: Option<f32>) -> Self {
        Self {
            version: env!("CARGO_PKG_VERSION"),
            machine: Machine::this(),
            load_average_before: load_average,
            load_average_after: None,
            device: String::new(),
            driver: String::new(),
            threads: thread_count(args.cpu.threads),
            seed: args.cpu.seed,
            runs: args.runs,
            rays: args.rays,
            size: [args.size.width, args.size.height],
            scenes: Vec::new(),
        }
    }

    /// Adds what was found in a scene; its runs name the device.
    pub fn add(&mut self, found: &Found, scene: SceneDocument) {
        if let Some(run) = found.whole.last() {
            (self.device, self.driver) = (run.reported.device.clone(), run.reported.driver.clone());
        }
        self.scenes.push(scene);
    }

    /// As JSON, with a line end.
    ///
    /// # Errors
    /// [`Error::Internal`] if it cannot be written as JSON.
    pub fn json(&self) -> Result<String> {
        serde_json::to_string_pretty(self).map(|text| text + "\n").map_err(|e| Error::Internal(e.to_string()))
    }

    /// Errors over wall seconds, a line a scene, as SVG.
    #[must_use]
    pub fn plot(&self) -> String {
        const COLOURS: [&str; 7] = ["#0b63a5", "#c4451c", "#3b8132", "#7d4fa1", "#a8780a", "#0f8b8d", "#777777"];
        let median = |figure: &Option<Figure>| figure.map_or(f64::NAN, |figure| figure.median);
        let measured = self.scenes.iter().filter_map(|scene| Some((scene, scene.errors.as_ref()?)));
        let points = |errors: &Errors| {
            errors.points.iter().map(|point| (median(&point.wall_seconds), median(&point.relmse))).collect()
        };
        let lines: Vec<Line<'_>> = measured
            .zip(COLOURS.into_iter().cycle())
            .map(|((scene, errors), colour)| Line {
                name: &scene.scene,
                points: points(errors),
                colour,
                measured: true,
            })
            .collect();
        let axes = ["wall seconds from the start of the process", "relMSE, the reference's noise taken off"];
        log_log(&format!("{} threads, {}", self.threads, self.device), axes, &lines)
    }
}

impl SceneDocument {
    /// Figures over the runs on a scene.
    #[must_use]
    pub fn new(args: &ClockArgs, subject: &Subject, found: &Found) -> Self {
        let errors = subject.asked.reference.as_ref().zip(subject.reference_pixels.as_ref());
        Self {
            scene: subject.asked.name(),
            triangles: subject.scene.triangles.len(),
            whole_run: WholeRun::new(&found.whole),
            errors: errors.map(|(path, pixels)| Errors::new(path.display().to_string(), pixels, args, &found.timed)),
            moves: Moves::new(args, &found.walks),
        }
    }
}

/// A figure over what each of some runs tells; `None` if one does not.
fn figure<T>(runs: &[T], of: impl Fn(&T) -> Option<f64>) -> Option<Figure> {
    let values: Option<Vec<f64>> = runs.iter().map(of).collect();
    values.filter(|values| !values.is_empty()).map(Figure::of)
}

impl WholeRun {
    fn new(runs: &[Timed]) -> Self {
        let wall = |of: fn(&Times) -> Option<f64>| figure(runs, |run| of(&run.reported.times));
        let cpu = |of: fn(&CpuTimes) -> Option<f64>| figure(runs, |run| of(&run.reported.cpu));
        Self {
            wall_seconds: Stages {
                first_frame: wall(|times| times.first_frame),
                lit_frame: wall(|times| times.lit_frame),
                complete_frame: wall(|times| times.complete_frame),
                last_frame: wall(|times| times.last_frame),
                end: figure(runs, |run| Some(run.wall)),
            },
            cpu_seconds: Stages {
                first_frame: cpu(|times| times.first_frame),
                lit_frame: cpu(|times| times.lit_frame),
                complete_frame: cpu(|times| times.complete_frame),
                last_frame: cpu(|times| times.last_frame),
                end: figure(runs, |run| run.cpu),
            },
            light_cpu_seconds: figure(runs, |run| Some(run.reported.cpu.light)),
            cores_refining: figure(runs, |run| cores_refining(&run.reported.times, &run.reported.cpu)),
            threads: Threads::new(runs),
            memory: MemoryFigures::new(runs),
        }
    }
}

/// Cores that a process keeps busy between its first frame with light and its last; `None` where there is nothing between.
fn cores_refining(times: &Times, cpu: &CpuTimes) -> Option<f64> {
    let wall = times.last_frame? - times.lit_frame?;
    (wall > 0.0).then_some((cpu.last_frame? - cpu.lit_frame?) / wall)
}

impl Threads {
    fn new(runs: &[Timed]) -> Option<Self> {
        let of = |of: fn(&ThreadTimes) -> f64| figure(runs, |run| run.reported.cpu.threads.as_ref().map(of));
        Some(Self {
            tracing: of(|times| times.tracing)?,
            engine: of(|times| times.engine)?,
            main: of(|times| times.main)?,
            rasteriser: of(|times| times.rasteriser)?,
            ended: of(|times| times.ended)?,
            tracing_share: of(tracing_share)?,
            serial_share: of(serial_share)?,
        })
    }
}

fn tracing_share(times: &ThreadTimes) -> f64 {
    let ThreadTimes { tracing, engine, main, rasteriser, ended } = *times;
    tracing / (tracing + engine + main + rasteriser + ended)
}

fn serial_share(times: &ThreadTimes) -> f64 {
    times.engine / (times.engine + times.tracing)
}

impl MemoryFigures {
    fn new(runs: &[Timed]) -> Self {
        let of = |of: fn(&Timed) -> Option<u64>| figure(runs, |run| of(run).map(|count| count as f64));
        let bytes_a_triangle = |run: &Timed| {
            let memory = &run.reported.memory;
            (memory.triangles > 0).then(|| memory.cache_bytes as f64 / memory.triangles as f64)
        };
        Self {
            triangles: of(|run| Some(run.reported.memory.triangles)),
            bytes_a_triangle: figure(runs, bytes_a_triangle),
            cache_bytes: of(|run| Some(run.reported.memory.cache_bytes)),
            device_bytes: of(|run| Some(run.reported.memory.device_bytes)),
            peak_bytes: of(|run| run.reported.memory.peak_bytes),
        }
    }
}

impl Errors {
    fn new(reference: String, pixels: &ReferencePixels, args: &ClockArgs, runs: &[Vec<(Timed, ImageError)>]) -> Self {
        let size = pixels.image().size;
        let times = args.times().into_iter().enumerate();
        let curves = |of: fn(&Timed) -> Option<f64>| -> Vec<Curve> {
            let point = |(timed, error): &(Timed, ImageError)| Some((of(timed)?, error.relmse));
            runs.iter().filter_map(|run| run.iter().map(point).collect()).collect()
        };
        let (wall, cpu) = (curves(|timed| Some(timed.wall)), curves(|timed| timed.cpu));
        Self {
            reference,
            size: [size.width, size.height],
            compared: pixels.counted(),
            own_relmse: pixels.own_relmse(),
            points: times.map(|(index, time)| Point::new(time.as_secs_f64(), index, runs)).collect(),
            targets: args.targets.iter().map(|&relmse| Target::new(relmse, &wall, &cpu)).collect(),
        }
    }
}

impl Point {
    fn new(time: f64, index: usize, runs: &[Vec<(Timed, ImageError)>]) -> Self {
        let of = |of: fn(&(Timed, ImageError)) -> Option<f64>| figure(runs, |run| of(run.get(index)?));
        Self {
            time,
            wall_seconds: of(|(timed, _)| Some(timed.wall)),
            cpu_seconds: of(|(timed, _)| timed.cpu),
            light_cpu_seconds: of(|(timed, _)| Some(timed.reported.cpu.light)),
            relmse: of(|(_, error)| Some(error.relmse)),
            mean_shift: of(|(_, error)| Some(error.mean_shift)).map_or(f64::NAN, |figure| figure.median),
        }
    }
}

impl Target {
    /// From the curves of the runs, over wall and over CPU seconds.
    fn new(relmse: f64, wall: &[Curve], cpu: &[Curve]) -> Self {
        let time = |curves: &[Curve]| {
            // What is not reached takes longer than anything that is.
            let seconds = |curve: &Curve| crossing(curve, relmse).map_or(f64::INFINITY, |crossing| crossing.at);
            figure(curves, |curve| Some(seconds(curve))).filter(|figure| figure.median.is_finite())
        };
        let at_most = wall.iter().filter_map(|curve| crossing(curve, relmse)).any(|crossing| crossing.at_most);
        Self { relmse, wall_seconds: time(wall), cpu_seconds: time(cpu), at_most }
    }
}

impl Moves {
    fn new(args: &ClockArgs, walks: &[Vec<Move>]) -> Self {
        Self {
            camera_path: args.camera_path.as_ref().map(|path| path.display().to_string()),
            pictures: args.pictures,
            engine_ms: Cost::new(walks, |move_| Some(move_.engine_ms)),
            device_ms: Cost::new(walks, |move_| move_.device_ms),
            wall_ms: Cost::new(walks, |move_| Some(move_.wall_ms)),
        }
    }
}

impl Cost {
    /// Median and worst of each walk, then over the walks; `None` if a move does not tell.
    fn new(walks: &[Vec<Move>], of: fn(&Move) -> Option<f64>) -> Option<Self> {
        let worst = |walk: &Vec<Move>| walk.iter().map(of).try_fold(0.0, |worst: f64, cost| Some(worst.max(cost?)));
        Some(Self {
            median: figure(walks, |walk| figure(walk, of).map(|figure| figure.median))?,
            worst: figure(walks, worst)?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn figure_of(values: &[f64]) -> Figure {
        Figure::of(values.to_vec())
    }

    #[test]
    fn what_one_run_does_not_tell_is_not_known() {
        assert_eq!(figure(&[1.0, 3.0, 2.0], |&v| Some(v)), Some(figure_of(&[1.0, 2.0, 3.0])));
        assert_eq!(figure(&[1.0, 3.0], |&v| (v < 2.0).then_some(v)), None);
        assert_eq!(figure(&[], |&v: &f64| Some(v)), None);
    }

    #[test]
    fn a_target_is_the_median_of_the_runs_that_may_miss_it() {
        let run = |end: f64| vec![(1.0, 1.0), (4.0, end)];
        let target = |runs: &[Curve], relmse| Target::new(relmse, runs, &[]);
        let found = target(&[run(0.25), run(0.25), run(0.9)], 0.5);
        assert!((found.wall_seconds.unwrap().median - 2.0).abs() < 1e-9 && !found.at_most, "{found:?}");
        assert!(found.cpu_seconds.is_none());
        assert!(target(&[run(0.25), run(0.9), run(0.9)], 0.5).wall_seconds.is_none());
        let soon = target(&[run(0.25)], 2.0);
        assert!(soon.at_most && soon.wall_seconds == Some(figure_of(&[1.0])), "{soon:?}");
    }

    #[test]
    fn shares_are_of_what_they_say() {
        let times = ThreadTimes { tracing: 6.0, engine: 2.0, main: 1.0, rasteriser: 2.0, ended: 1.0 };
        assert_eq!((tracing_share(&times), serial_share(&times)), (0.5, 0.25));
        let mut wall = Times { lit_frame: Some(1.0), last_frame: Some(3.0), ..Times::default() };
        let cpu = CpuTimes { lit_frame: Some(1.5), last_frame: Some(4.5), ..CpuTimes::default() };
        assert_eq!(cores_refining(&wall, &cpu), Some(1.5));
        assert_eq!(cores_refining(&wall, &CpuTimes { lit_frame: None, ..cpu }), None);
        wall.lit_frame = wall.last_frame;
        assert_eq!(cores_refining(&wall, &cpu), None);
    }

    #[test]
    fn moves_have_a_median_and_a_worst_in_each_walk() {
        let walk = |costs: [f64; 3]| {
            costs.map(|ms| Move { engine_ms: ms, device_ms: (ms < 50.0).then_some(ms), wall_ms: ms }).to_vec()
        };
        let walks = [walk([1.0, 2.0, 9.0]), walk([3.0, 5.0, 4.0]), walk([6.0, 7.0, 100.0])];
        let cost = Cost::new(&walks, |move_| Some(move_.engine_ms)).unwrap();
        assert_eq!((cost.median, cost.worst), (figure_of(&[2.0, 4.0, 7.0]), figure_of(&[9.0, 5.0, 100.0])));
        assert!(Cost::new(&walks, |move_| move_.device_ms).is_none());
    }
}
