//! A recording replayed in an update mode, compared after every few updates with a full redraw of the same state.

use super::Recording;
use super::artefacts::{Counts, Mark, Shown, Surface, Truth, compare, marks};
use super::mesh::Mesh;
use crate::error::Result;
use crate::pass::{FrameOptions, FrameStats, LuminanceLayers, Renderer, UpdateMode};
use glam::{Vec2, Vec3};

/// Updates at most: as many writes as half floats count exactly, in the modes that write some pixels twice.
pub const MAX_UPDATES: usize = 1000;

/// What full redraws show at each comparison.
pub struct Truths {
    /// What the camera sees.
    pub surface: Surface,
    /// Updates between comparisons.
    every: usize,
    points: Vec<Point>,
}

struct Point {
    truth: Truth,
    /// Triangle id + 1 of each pixel by `lookup`.
    by_lookup: Option<Vec<u32>>,
}

/// A mode's run.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// The mode.
    pub mode: UpdateMode,
    /// Frames drawn.
    pub frames: u64,
    /// Updates drawn.
    pub updates: usize,
    /// Draw commands of the luminance pass.
    pub draws: u64,
    /// Occlusion queries.
    pub queries: u64,
    /// Events of the whole run, errors at its end.
    pub counts: Counts,
    /// What each comparison found, by the number of updates before it.
    pub steps: Vec<(usize, Counts)>,
    /// Milliseconds of the luminance pass by the device's clock, an update each.
    pub luminance_ms: Vec<f64>,
    /// The last picture, radiance.
    pub radiance: Vec<Vec3>,
    /// What is wrong with it.
    pub marks: Vec<Mark>,
}

fn options(update_mode: UpdateMode) -> FrameOptions {
    FrameOptions { update_mode, ..FrameOptions::default() }
}

fn full(update_mode: UpdateMode) -> FrameOptions {
    FrameOptions { full_luminance: true, ..options(update_mode) }
}

/// Shows what a recording begins with.
fn begin(renderer: &mut Renderer, recording: &Recording, mode: UpdateMode) -> Result<()> {
    renderer.set_view(&recording.view, Vec2::ZERO);
    renderer.visibility()?;
    renderer.reset_drawn();
    if let Some(first) = recording.updates.first() {
        renderer.apply(first)?;
    }
    renderer.frame(&FrameOptions { colour: true, ..full(mode) }).map(|_| ())
}

impl Truths {
    /// Redraws everything after every `every` updates; `stop` ends it early.
    ///
    /// # Errors
    /// The device is lost or memory runs out.
    pub fn new(
        renderer: &mut Renderer,
        recording: &Recording,
        every: usize,
        looks_up: bool,
        stop: &dyn Fn() -> bool,
    ) -> Result<Self> {
        begin(renderer, recording, UpdateMode::Full)?;
        let layers = renderer.read_layers()?;
        let surface = Surface { face_id: layers.face_id, kd: layers.kd, ks: layers.ks, emitted: layers.le };
        let mut points = Vec::new();
        for (number, update) in recording.updates.iter().enumerate().skip(1) {
            if stop() {
                break;
            }
            renderer.apply(update)?;
            if is_compared(number, every, recording) {
                renderer.frame(&full(UpdateMode::Full))?;
                let light = renderer.read_luminance()?;
                let radiance = (0..light.drawn_id.len()).map(|i| surface.radiance(&light, i)).collect();
                let by_lookup = looks_up.then(|| {
                    renderer.frame(&full(UpdateMode::Lookup))?;
                    renderer.read_luminance().map(|light| light.drawn_id)
                });
                points.push(Point {
                    truth: Truth { drawn_id: light.drawn_id, radiance },
                    by_lookup: by_lookup.transpose()?,
                });
            }
        }
        Ok(Self { surface, every, points })
    }

    /// The picture that a run without artefacts ends with, radiance.
    #[must_use]
    pub fn last(&self) -> Option<&[Vec3]> {
        self.points.last().map(|point| point.truth.radiance.as_slice())
    }
}

/// Whether a comparison follows an update: every few, and the last.
fn is_compared(number: usize, every: usize, recording: &Recording) -> bool {
    number.is_multiple_of(every) || number + 1 == recording.updates.len()
}

/// How often pixels were written since the last comparison.
struct Writes {
    before: Vec<u16>,
    since: Vec<u16>,
    doubled: Vec<bool>,
}

impl Writes {
    fn new(light: &LuminanceLayers) -> Self {
        let pixels = light.writes.len();
        Self { before: light.writes.clone(), since: vec![0; pixels], doubled: vec![false; pixels] }
    }

    /// Takes an update in that changed some pixels, or all.
    fn add(&mut self, light: &LuminanceLayers, full: bool) {
        for (pixel, &now) in light.writes.iter().enumerate() {
            let written = now.saturating_sub(if full { 0 } else { self.before[pixel] });
            self.since[pixel] = self.since[pixel].saturating_add(written);
            // A full redraw also writes what is hidden later.
            self.doubled[pixel] |= written > 1 && !full;
        }
        self.before.copy_from_slice(&light.writes);
    }

    fn restart(&mut self) {
        self.since.fill(0);
        self.doubled.fill(false);
    }
}

/// Replays a recording in a mode that the renderer was made for, with writes counted; `stop` ends it early.
///
/// # Errors
/// The device is lost or memory runs out.
pub fn replay(
    renderer: &mut Renderer,
    recording: &Recording,
    mode: UpdateMode,
    truths: &Truths,
    stop: &dyn Fn() -> bool,
) -> Result<Outcome> {
    begin(renderer, recording, mode)?;
    let mut mesh = Mesh::default();
    recording.updates.iter().take(1).for_each(|first| mesh.apply(first));
    let mut light = renderer.read_luminance()?;
    let mut writes = Writes::new(&light);
    let mut outcome = Outcome::empty(mode);
    let mut since = mesh.updates();
    let mut points = truths.points.iter();
    for (number, update) in recording.updates.iter().enumerate().skip(1) {
        if stop() {
            break;
        }
        renderer.apply(update)?;
        mesh.apply(update);
        let full = outcome.draw(renderer)?;
        light = renderer.read_luminance()?;
        writes.add(&light, full);
        if !is_compared(number, truths.every, recording) {
            continue;
        }
        let Some(point) = points.next() else { break };
        let masks = point.by_lookup.as_ref().filter(|_| mode == UpdateMode::Lookup).unwrap_or(&point.truth.drawn_id);
        let (written, doubled) = (writes.since.as_slice(), writes.doubled.as_slice());
        let shown = Shown { light: &light, written, doubled, goes_by_face: mode.goes_by_face(), since };
        outcome.add(number, compare(&truths.surface, &mesh, &point.truth, masks, &shown));
        if number + 1 == recording.updates.len() {
            outcome.marks = marks(&truths.surface, &mesh, &point.truth, masks, &shown);
        }
        since = mesh.updates();
        writes.restart();
    }
    outcome.radiance = (0..light.drawn_id.len()).map(|i| truths.surface.radiance(&light, i)).collect();
    Ok(outcome)
}

impl Outcome {
    /// A run that has not drawn anything.
    #[must_use]
    pub const fn empty(mode: UpdateMode) -> Self {
        Self {
            mode,
            frames: 0,
            updates: 0,
            draws: 0,
            queries: 0,
            counts: Counts::ZERO,
            steps: Vec::new(),
            luminance_ms: Vec::new(),
            radiance: Vec::new(),
            marks: Vec::new(),
        }
    }

    /// Draws what waits; whether all drawn triangles were.
    fn draw(&mut self, renderer: &mut Renderer) -> Result<bool> {
        let (mut full, mut ms) = (false, 0.0);
        self.updates += 1;
        while renderer.has_pending() {
            let stats: FrameStats = renderer.frame(&options(self.mode))?;
            self.frames += 1;
            self.draws += u64::from(stats.draws);
            self.queries += u64::from(stats.queries);
            full |= stats.full;
            ms += stats.luminance_ms.unwrap_or(0.0);
        }
        self.luminance_ms.push(ms);
        Ok(full)
    }

    fn add(&mut self, update: usize, counts: Counts) {
        self.counts.add(&counts);
        self.steps.push((update, counts));
    }
}
