//! The progress line: time, rays/s, vertices, estimated error, on a terminal only.

use super::interrupt;
use crate::refine::update::EngineStats;
use indicatif::{HumanCount, ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::time::Duration;

/// One line at the bottom of standard error; nothing when that is no terminal or the user wants quiet.
#[derive(Debug)]
pub struct Progress {
    bar: ProgressBar,
    /// Which of several pictures is made.
    picture: String,
}

impl Progress {
    /// A line that appears with the first update.
    #[must_use]
    pub fn new(quiet: bool) -> Self {
        let bar = if quiet {
            ProgressBar::hidden()
        } else {
            // Ten times a second is smooth enough to read; indicatif hides it when standard error is no terminal.
            ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr_with_hz(10))
        };
        Self {
            bar: bar.with_style(ProgressStyle::with_template("{msg}").unwrap_or_else(|_| ProgressStyle::default_bar())),
            picture: String::new(),
        }
    }

    /// Says which of several pictures is made from now on, from 0.
    pub fn picture(&mut self, index: u64, of: u64) {
        self.picture = if of > 1 { format!("{}/{of}  ", index + 1) } else { String::new() };
    }

    /// Shows the state of the engine at `elapsed` since the first frame.
    pub fn update(&self, elapsed: Duration, stats: &EngineStats) {
        if !self.bar.is_hidden() {
            self.bar.set_message(self.picture.clone() + &line(elapsed, stats));
            self.bar.tick();
        }
    }

    /// Says what keeps the first frame waiting, once that has taken a while.
    pub fn waits(&self, elapsed: Duration) {
        const A_WHILE: Duration = Duration::from_millis(500);
        if elapsed >= A_WHILE && !self.bar.is_hidden() {
            self.bar.set_message(format!("building the ray hierarchy, {:.1} s", elapsed.as_secs_f64()));
            self.bar.tick();
        }
    }

    /// Prints a line above the progress line.
    pub fn report(&self, text: &str) {
        self.bar.suspend(|| super::output::report(text));
    }

    /// Takes the line away.
    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.finish();
    }
}

fn line(elapsed: Duration, stats: &EngineStats) -> String {
    let seconds = elapsed.as_secs_f64();
    let rate = if seconds > 0.0 { stats.rays as f64 / seconds } else { 0.0 };
    let vertices = HumanCount(stats.vertices);
    let error = match stats.estimated_error {
        Some(error) => format!("{:.2} %", error * 100.0),
        None => "not known yet".to_owned(),
    };
    let end = if stats.converged { "  converged" } else { "" };
    format!("{seconds:.1} s  {} rays/s  {vertices} vertices  error {error}{end}", short(rate))
}

/// A number with three digits and k, M or G.
fn short(value: f64) -> String {
    let (scaled, unit) = match value {
        v if v >= 1e9 => (v / 1e9, " G"),
        v if v >= 1e6 => (v / 1e6, " M"),
        v if v >= 1e3 => (v / 1e3, " k"),
        v => (v, " "),
    };
    let decimals = if scaled >= 100.0 {
        0
    } else if scaled >= 10.0 {
        1
    } else {
        2
    };
    format!("{scaled:.decimals$}{unit}").trim_end().to_owned()
}

/// A line that says what is being measured, on a terminal only.
#[must_use]
pub fn measuring(quiet: bool) -> ProgressBar {
    if quiet {
        return ProgressBar::hidden();
    }
    let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr_with_hz(10));
    bar.with_style(ProgressStyle::with_template("{elapsed} {msg}").unwrap_or_else(|_| ProgressStyle::default_bar()))
}

/// Says what is going on; whether to go on.
pub fn say(progress: &ProgressBar, what: &str) -> bool {
    progress.set_message(what.to_owned());
    progress.tick();
    !interrupt::requested()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_line_says_what_the_interface_promises() {
        let mut stats = EngineStats { rays: 3_000_000, vertices: 12_345, ..Default::default() };
        let text = line(Duration::from_millis(2500), &stats);
        assert_eq!(text, "2.5 s  1.20 M rays/s  12,345 vertices  error not known yet");
        stats.estimated_error = Some(0.0123);
        stats.converged = true;
        let text = line(Duration::ZERO, &stats);
        assert_eq!(text, "0.0 s  0.00 rays/s  12,345 vertices  error 1.23 %  converged");
    }

    #[test]
    fn numbers_keep_three_digits() {
        let texts = [0.0, 9.5, 999.0, 1_000.0, 45_600.0, 2e6, 123e6, 4.5e9].map(short);
        assert_eq!(texts, ["0.00", "9.50", "999", "1.00 k", "45.6 k", "2.00 M", "123 M", "4.50 G"]);
    }
}
