//! Figures: what frames take, how far the light is.

use crate::app::rate::{PassTimes, Rate};
use crate::app::viewer::Viewer;
use crate::refine::update::{EngineStats, MemoryStats};
use egui::{Color32, Grid, RichText, Ui};

/// Colour of what is not up to date.
const STALE: Color32 = Color32::from_rgb(255, 200, 80);

/// Lays them out.
pub(super) fn lay_out(ui: &mut Ui, viewer: &Viewer, rate: Rate) {
    let EngineStats { rays, vertices, estimated_error, converged, outdated, .. } = *viewer.stats();
    let size = viewer.session().size();
    Grid::new("figures").num_columns(2).show(ui, |ui| {
        let mut row = |name: &str, value: String| {
            ui.label(RichText::new(name).weak());
            ui.monospace(value);
            ui.end_row();
        };
        row("frames", format!("{:.1} fps  {:.1} ms  {size}", rate.pictures, rate.frame_ms));
        passes(rate.passes).into_iter().for_each(|line| row("", line));
        row("rays", format!("{}  {}/s", short(rays as f64), short(rate.rays)));
        row("vertices", short(vertices as f64));
        row("memory", memory(viewer, rate.resident));
        row("light", light(&viewer.stats().memory));
        let error = estimated_error.map_or_else(|| "-".to_owned(), |error| format!("{:.2} %", error * 100.0));
        row("error", format!("{error}{}", if converged { "  done" } else { "" }));
        if let Some(samples) = viewer.reference_samples() {
            row("reference", format!("{samples} {} a pixel", if samples == 1 { "sample" } else { "samples" }));
        }
        if viewer.is_recording() {
            row("recording", format!("{:.1} s", viewer.time()));
        }
    });
    // What an engine that has nothing left to do did not gather again was not worth it.
    if outdated > 0 && !converged {
        let text = format!("stale: indirect light of {} vertices", short(outdated as f64));
        ui.label(RichText::new(text).color(STALE)).on_hover_text(
            "The lights were changed: indirect light is a guess from before where it was not gathered again. \
             The view `stale` shows where.",
        );
    }
}

/// What the passes took when they last ran, two to a line; none where none has run.
fn passes(PassTimes { visibility, colour, luminance, combine }: PassTimes) -> Vec<String> {
    let of = |name: &str, ms: Option<f64>| ms.map_or_else(String::new, |ms| format!("{name} {ms:.1} ms"));
    let lines =
        [[of("visibility", visibility), of("colour", colour)], [of("luminance", luminance), of("combine", combine)]];
    let join = |line: [String; 2]| line.into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join("  ");
    lines.map(join).into_iter().filter(|line| !line.is_empty()).collect()
}

/// Memory of the light, of the device, and of the process with all of it.
fn memory(viewer: &Viewer, resident: Option<u64>) -> String {
    let mib = |bytes: u64| format!("{:.0}", bytes as f64 / f64::from(1 << 20));
    let device = viewer.session().renderer().device().memory_bytes();
    let process = resident.map_or_else(String::new, |bytes| format!("  process {}", mib(bytes)));
    format!("light {}  device {}{process} MiB", mib(viewer.stats().cache_bytes), mib(device))
}

/// Memory of the light against its budget, and what became of what did not fit in.
fn light(memory: &MemoryStats) -> String {
    let mib = |bytes: u64| format!("{:.0}", bytes as f64 / f64::from(1 << 20));
    let MemoryStats { budget, held, free, evicted, paged_in, full, .. } = *memory;
    let of = if budget > 0 { format!(" of {}", mib(budget)) } else { String::new() };
    let gone = if evicted > 0 {
        format!("  {} faces out, {paged_in} parts back", short(evicted as f64))
    } else {
        String::new()
    };
    format!("{}{of} MiB, {} free{gone}{}", mib(held), mib(free), if full { "  full" } else { "" })
}

/// A number in thousands and the like.
pub(super) fn short(value: f64) -> String {
    let (scale, suffix) = match value {
        v if v >= 1e9 => (1e9, " G"),
        v if v >= 1e6 => (1e6, " M"),
        v if v >= 1e4 => (1e3, " k"),
        _ => return format!("{value:.0}"),
    };
    format!("{:.2}{suffix}", value / scale)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short() {
        let all = [0.0, 950.4, 9999.0, 12_345.0, 3_450_000.0, 7.2e9].map(short);
        assert_eq!(all, ["0", "950", "9999", "12.35 k", "3.45 M", "7.20 G"]);
    }

    #[test]
    fn passes_that_never_ran_take_no_room() {
        assert_eq!(passes(PassTimes::default()), [""; 0]);
        let some = PassTimes { luminance: Some(1.25), combine: Some(0.5), ..PassTimes::default() };
        assert_eq!(passes(some), ["luminance 1.2 ms  combine 0.5 ms"]);
    }
}
