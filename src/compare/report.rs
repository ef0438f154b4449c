//! The figures of a comparison, as JSON and CSV hold them (interface: `report.json`).

use super::cost::{Cost, median};
use super::replay::Outcome;
use super::{DepthChoice, Recording};
use crate::error::{Error, Result};
use crate::pass::UpdateMode;
use crate::vk::DeviceReport;
use serde::Serialize;

/// Everything that was measured, and on what.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Report {
    /// The command line, an element an argument.
    pub command: Vec<String>,
    /// Version of the program.
    pub version: &'static str,
    /// File name of the scene.
    pub scene: String,
    /// The device, its driver, limits and formats.
    pub device: Option<DeviceReport>,
    /// Image size in pixels.
    pub size: [u32; 2],
    /// Updates of a recording.
    pub updates: usize,
    /// Updates between comparisons.
    pub every: usize,
    /// Rays of an update.
    pub rays: u64,
    /// Seed of all random choices.
    pub seed: u64,
    /// The cameras.
    pub tilts: Vec<TiltRow>,
    /// Artefacts, a row a mode, depth and tilt.
    pub modes: Vec<ModeRow>,
    /// Cost, a row a mode and number of patches.
    pub costs: Vec<Cost>,
    /// Runs that each cost is the median of.
    pub cost_runs: usize,
    /// What could not be compared here, and why.
    pub refused: Vec<String>,
    /// Limits exceeded.
    pub exceeded: Vec<String>,
    /// Whether a signal ended the run before everything was measured.
    pub interrupted: bool,
    /// Wall-clock time of the command, seconds.
    pub seconds: f64,
}

/// A camera.
#[derive(Clone, Debug, Serialize)]
pub struct TiltRow {
    /// Its name.
    pub name: &'static str,
    /// Angle between the view and the normal of the main surface, degrees.
    pub degrees: f32,
    /// Eye.
    pub position: [f32; 3],
    /// Point looked at.
    pub look_at: [f32; 3],
    /// Near plane, scene units.
    pub near: f32,
    /// Patches of the recording, those of the first update left out.
    pub patches: usize,
}

impl TiltRow {
    /// The row of a recording.
    #[must_use]
    pub fn new(recording: &Recording) -> Self {
        Self {
            name: recording.tilt,
            degrees: recording.degrees,
            position: recording.camera.position.to_array(),
            look_at: recording.camera.look_at.to_array(),
            near: recording.view.near,
            patches: recording.updates.iter().skip(1).map(|update| update.patches.len()).sum(),
        }
    }
}

/// Artefacts of a mode. Events are sums over the run, errors and states stand at its end.
#[derive(Clone, Debug, Serialize)]
pub struct ModeRow {
    /// The mode.
    pub mode: &'static str,
    /// The tilt.
    pub tilt: &'static str,
    /// Format of the depth image.
    pub depth_format: &'static str,
    /// Which end of its range is near.
    pub depth_order: &'static str,
    /// Frames drawn.
    pub frames: u64,
    /// Updates drawn.
    pub updates: usize,
    /// Pixels to update.
    pub updated_pixels: u64,
    /// Those that were not written.
    pub missed_pixels: u64,
    /// Pixels written with another face than belongs there.
    pub foreign_pixels: u64,
    /// Pixels written twice in an update.
    pub double_pixels: u64,
    /// Missed of the pixels to update.
    pub missed_fraction: f64,
    /// Foreign pixels likewise.
    pub foreign_fraction: f64,
    /// Double pixels likewise.
    pub double_fraction: f64,
    /// Pixels with geometry.
    pub visible_pixels: u64,
    /// Share of them that show a triangle which is no longer part of the mesh, at the end.
    pub stale_fraction: f64,
    /// Share of the measured pixels whose luminance is off by more than 2 %, at the end.
    pub wrong_fraction: f64,
    /// Share of the measured pixels within 0.1 % of the full redraw in every channel, at the end.
    pub close_fraction: f64,
    /// Pixels where the full redraw shows another face than is visible, so that no error is measured.
    pub unmeasured_pixels: u64,
    /// Largest error of a channel, W·sr⁻¹·m⁻².
    pub max_error: f64,
    /// Mean absolute error, W·sr⁻¹·m⁻².
    pub mean_error: f64,
    /// Mean absolute error against the mean of the full redraw.
    pub relative_error: f64,
    /// Mean FLIP error of the last picture.
    pub flip: f64,
    /// Median of the luminance pass by the device's clock, ms an update.
    pub luminance_ms_median: f64,
    /// Draw commands of the luminance pass.
    pub draws: u64,
    /// Occlusion queries.
    pub queries: u64,
    /// What each comparison found.
    pub steps: Vec<StepRow>,
}

/// A comparison.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct StepRow {
    /// Updates drawn before it.
    pub update: usize,
    /// Pixels to update since the comparison before.
    pub updated: u64,
    /// Of these, those not written.
    pub missed: u64,
    /// Foreign pixels since the comparison before.
    pub foreign: u64,
    /// Share of stale pixels.
    pub stale_fraction: f64,
    /// Share of pixels whose luminance is off by more than 2 %.
    pub wrong_fraction: f64,
}

fn share(part: u64, whole: u64) -> f64 {
    super::artefacts::ratio(part as f64, whole as f64)
}

impl ModeRow {
    /// The row of a run with the FLIP error of its last picture.
    #[must_use]
    pub fn new(outcome: &Outcome, tilt: &'static str, depth: DepthChoice, flip: f64) -> Self {
        let counts = &outcome.counts;
        let step = |&(update, c): &(usize, super::artefacts::Counts)| StepRow {
            update,
            updated: c.updated,
            missed: c.missed,
            foreign: c.foreign,
            stale_fraction: share(c.stale, c.visible),
            wrong_fraction: share(c.wrong, c.measured()),
        };
        Self {
            mode: outcome.mode.name(),
            tilt,
            depth_format: depth.format.name(),
            depth_order: depth.order.name(),
            frames: outcome.frames,
            updates: outcome.updates,
            updated_pixels: counts.updated,
            missed_pixels: counts.missed,
            foreign_pixels: counts.foreign,
            double_pixels: counts.double,
            missed_fraction: share(counts.missed, counts.updated),
            foreign_fraction: share(counts.foreign, counts.updated),
            double_fraction: share(counts.double, counts.updated),
            visible_pixels: counts.visible,
            stale_fraction: share(counts.stale, counts.visible),
            wrong_fraction: share(counts.wrong, counts.measured()),
            close_fraction: share(counts.close, counts.measured()),
            unmeasured_pixels: counts.unmeasured,
            max_error: counts.max_error,
            mean_error: counts.mean_error(),
            relative_error: counts.relative_error(),
            flip,
            luminance_ms_median: median(outcome.luminance_ms.clone()),
            draws: outcome.draws,
            queries: outcome.queries,
            steps: outcome.steps.iter().map(step).collect(),
        }
    }

    /// Depth format and order, as in `d24s8` or `d24s8-ordinary`.
    #[must_use]
    pub fn depth(&self) -> String {
        let ordinary = if self.depth_order == "ordinary" { "-ordinary" } else { "" };
        format!("{}{ordinary}", self.depth_format)
    }
}

/// The worst of a mode over depths and tilts.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Worst {
    /// Largest share of missed pixels.
    pub missed: f64,
    /// Smallest share of missed pixels.
    pub least_missed: f64,
    /// Largest share of foreign pixels.
    pub foreign: f64,
    /// Largest share of double pixels.
    pub double: f64,
    /// Largest share of stale pixels at the end.
    pub stale: f64,
    /// Largest share of visible errors at the end.
    pub wrong: f64,
    /// Largest mean error against the mean of the picture.
    pub relative_error: f64,
    /// Largest FLIP error.
    pub flip: f64,
}

/// Shares up to which a mode counts as clean: what cracks between triangles of other vertices leave (docs/update-modes.md).
pub const CLEAN_MISSED: f64 = 5e-5;
/// Foreign pixels likewise.
pub const CLEAN_FOREIGN: f64 = 2e-5;

impl Report {
    /// The worst of a mode; `None` if it was not compared.
    #[must_use]
    pub fn worst(&self, mode: &str) -> Option<Worst> {
        let rows: Vec<&ModeRow> = self.modes.iter().filter(|row| row.mode == mode).collect();
        let largest = |value: fn(&ModeRow) -> f64| rows.iter().map(|row| value(row)).fold(0.0, f64::max);
        (!rows.is_empty()).then(|| Worst {
            missed: largest(|row| row.missed_fraction),
            least_missed: rows.iter().map(|row| row.missed_fraction).fold(f64::INFINITY, f64::min),
            foreign: largest(|row| row.foreign_fraction),
            double: largest(|row| row.double_fraction),
            stale: largest(|row| row.stale_fraction),
            wrong: largest(|row| row.wrong_fraction),
            relative_error: largest(|row| row.relative_error),
            flip: largest(|row| row.flip),
        })
    }

    /// The modes that were compared, in the order of [`UpdateMode::ALL`].
    #[must_use]
    pub fn compared(&self) -> Vec<&'static str> {
        let there = |mode: &&str| self.modes.iter().any(|row| row.mode == *mode);
        UpdateMode::ALL.map(UpdateMode::name).into_iter().filter(there).collect()
    }

    /// Whether a mode drawn triangles no more than cracks.
    #[must_use]
    pub fn is_clean(&self, mode: &str) -> bool {
        self.worst(mode).is_some_and(|w| w.missed <= CLEAN_MISSED && w.foreign <= CLEAN_FOREIGN)
    }

    /// What an update of so many patches costs in a mode, milliseconds: CPU on a software device, else the device's time.
    #[must_use]
    pub fn cost(&self, mode: &str, patches: usize) -> Option<f64> {
        let row = self.costs.iter().find(|row| row.mode == mode && row.patches == patches)?;
        Some(if self.costs_are_cpu() { row.cpu_ms } else { row.gpu_ms })
    }

    /// Whether [`Self::cost`] is CPU time.
    #[must_use]
    pub fn costs_are_cpu(&self) -> bool {
        self.device.as_ref().is_some_and(|device| device.is_cpu())
    }

    /// The number of patches whose cost is quoted: 1,000, or the nearest measured.
    #[must_use]
    pub fn quoted_patches(&self) -> Option<usize> {
        let distance = |n: &usize| ((*n as f64).ln() - 1000f64.ln()).abs();
        self.costs.iter().map(|row| row.patches).min_by(|a, b| distance(a).total_cmp(&distance(b)))
    }

    /// The clean mode that costs least; `full` is no choice.
    #[must_use]
    pub fn best(&self) -> Option<&'static str> {
        let patches = self.quoted_patches()?;
        let clean = self.compared().into_iter().filter(|mode| *mode != "full" && self.is_clean(mode));
        let cost = |mode: &&str| self.cost(mode, patches).unwrap_or(f64::INFINITY);
        clean.min_by(|a, b| cost(a).total_cmp(&cost(b)))
    }

    /// What was found, in a line.
    #[must_use]
    pub fn line(&self) -> String {
        let missed = |mode: &&str| self.worst(mode).map(|w| format!("{mode} {}", percent(w.missed)));
        let compared = self.compared();
        let list = compared.iter().filter(|mode| **mode != "full").filter_map(missed).collect::<Vec<_>>().join(", ");
        let best = self.best().map_or_else(String::new, |mode| format!("; cheapest without artefacts: {mode}"));
        format!("missed at most: {list}{best}; {:.0} s", self.seconds)
    }

    /// As JSON.
    ///
    /// # Errors
    /// [`Error::Internal`] if a figure cannot be written.
    pub fn json(&self) -> Result<String> {
        serde_json::to_string_pretty(self).map(|text| text + "\n").map_err(|e| Error::Internal(e.to_string()))
    }

    /// Artefacts as CSV, a row a mode, depth and tilt.
    ///
    /// # Errors
    /// [`Error::Internal`] if a figure cannot be written.
    pub fn artefacts_csv(&self) -> Result<String> {
        let header = "mode,tilt,depth_format,depth_order,frames,updates,updated_pixels,missed_pixels,foreign_pixels,double_pixels,\
            missed_fraction,foreign_fraction,double_fraction,stale_fraction,wrong_fraction,max_error,mean_error,relative_error,\
            flip,luminance_ms_median,draws,queries";
        let rows = self.modes.iter().map(|r| {
            let names = [r.mode, r.tilt, r.depth_format, r.depth_order].map(str::to_owned);
            let pixels = [r.updated_pixels, r.missed_pixels, r.foreign_pixels, r.double_pixels];
            let shares = [
                r.missed_fraction,
                r.foreign_fraction,
                r.double_fraction,
                r.stale_fraction,
                r.wrong_fraction,
                r.max_error,
                r.mean_error,
                r.relative_error,
                r.flip,
                r.luminance_ms_median,
            ];
            let counts = [r.frames, r.updates as u64].into_iter().chain(pixels).map(|n| n.to_string());
            let ends = [r.draws, r.queries].map(|n| n.to_string());
            names.into_iter().chain(counts).chain(shares.map(|s| format!("{s:.6e}"))).chain(ends).collect()
        });
        csv_text(header, rows)
    }

    /// Costs as CSV, a row a mode and number of patches.
    ///
    /// # Errors
    /// [`Error::Internal`] if a figure cannot be written.
    pub fn costs_csv(&self) -> Result<String> {
        let rows = self.costs.iter().map(|r| {
            let times = [r.gpu_ms, r.cpu_ms].map(|ms| format!("{ms:.4}"));
            let counts = [r.draws, r.queries, r.frames].map(|n| n.to_string());
            [r.mode.to_owned(), r.patches.to_string()].into_iter().chain(times).chain(counts).collect()
        });
        csv_text("mode,patches,gpu_ms,cpu_ms,draws,queries,frames", rows)
    }
}

fn csv_text(header: &str, rows: impl Iterator<Item = Vec<String>>) -> Result<String> {
    let fault = |e: &dyn std::fmt::Display| Error::Internal(e.to_string());
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(header.split(',')).map_err(|e| fault(&e))?;
    for row in rows {
        writer.write_record(row).map_err(|e| fault(&e))?;
    }
    let bytes = writer.into_inner().map_err(|e| fault(&e))?;
    String::from_utf8(bytes).map_err(|e| fault(&e))
}

/// A share in per cent, two digits or more: `0`, `0.0012 %`, `38 %`.
#[must_use]
pub fn percent(share: f64) -> String {
    let value = share * 100.0;
    match value {
        0.0 => "0".to_owned(),
        v if v >= 9.95 => format!("{v:.0} %"),
        v if v >= 0.995 => format!("{v:.1} %"),
        v => {
            let decimals = (1.0 - v.abs().log10().floor()).clamp(2.0, 8.0) as usize;
            format!("{v:.decimals$} %")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pass::{DepthFormat, DepthOrder};

    #[test]
    fn shares_keep_two_digits() {
        let texts = [0.0, 0.384, 0.0123, 0.0045, 1.2e-5, 3.4e-7, 1.0].map(percent);
        assert_eq!(texts, ["0", "38 %", "1.2 %", "0.45 %", "0.0012 %", "0.000034 %", "100 %"]);
    }

    #[test]
    fn the_cheapest_clean_mode_is_best() {
        let row = |mode, missed_fraction| ModeRow {
            missed_fraction,
            ..ModeRow::new(
                &Outcome::empty(mode),
                "frontal",
                DepthChoice { format: DepthFormat::D32S8, order: DepthOrder::Reversed },
                0.0,
            )
        };
        let cost = |mode: UpdateMode, cpu_ms, gpu_ms| Cost {
            mode: mode.name(),
            patches: 1000,
            gpu_ms,
            cpu_ms,
            draws: 1,
            queries: 0,
            frames: 1,
        };
        use UpdateMode::{DepthEqual, Full, Id, Stencil};
        let mut report = Report {
            modes: vec![row(Stencil, 1e-5), row(Id, 0.0), row(Full, 0.0), row(DepthEqual, 0.4)],
            costs: vec![cost(Stencil, 9.0, 2.0), cost(Id, 8.0, 3.0), cost(Full, 1.0, 1.0), cost(DepthEqual, 1.0, 1.0)],
            ..Report::default()
        };
        assert_eq!((report.best(), report.costs_are_cpu()), (Some("stencil"), false));
        assert!(report.line().contains("depth-equal 40 %") && report.line().contains("stencil 0.0010 %"));
        report.modes[0].missed_fraction = 1e-3;
        assert_eq!(report.best(), Some("id"));
        let csv = report.artefacts_csv().expect("csv");
        let columns = |line: &str| line.split(',').count();
        assert!(csv.lines().all(|line| columns(line) == columns(csv.lines().next().expect("header"))), "{csv}");
        assert_eq!(csv.lines().count(), 5);
        assert!(report.costs_csv().expect("csv").contains("id,1000,3.0000,8.0000,1,0,1"));
    }
}
