//! The estimated error over time, for a graph.

/// Points at most: about as many as a graph has pixels.
const MOST: usize = 240;
/// Seconds between two points at first.
const APART: f64 = 0.1;

/// Errors with their times. When there are too many, every other one goes, and those that follow come half as often.
#[derive(Debug)]
pub struct History {
    points: Vec<(f64, f32)>,
    apart: f64,
}

impl Default for History {
    fn default() -> Self {
        Self { points: Vec::new(), apart: APART }
    }
}

impl History {
    /// Notes the error at a time, seconds, if it is known.
    pub fn note(&mut self, time: f64, error: Option<f32>) {
        let Some(error) = error.filter(|error| *error > 0.0) else { return };
        if self.points.last().is_some_and(|(last, _)| time < last + self.apart) {
            return;
        }
        self.points.push((time, error));
        if self.points.len() > MOST {
            let mut number = 0;
            self.points.retain(|_| {
                number += 1;
                number % 2 == 1
            });
            self.apart *= 2.0;
        }
    }

    /// Times, seconds, and errors, in order of time.
    #[must_use]
    pub fn points(&self) -> &[(f64, f32)] {
        &self.points
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_history_keeps_its_ends_and_its_length() {
        let mut history = History::default();
        history.note(0.0, None);
        for frame in 0..100_000 {
            history.note(f64::from(frame) * 0.04, Some(1.0 / (1.0 + frame as f32)));
        }
        let points = history.points();
        assert!((MOST / 3..=MOST).contains(&points.len()), "{}", points.len());
        assert_eq!(points[0], (0.0, 1.0));
        assert!(points.last().unwrap().0 > 3900.0);
        assert!(points.windows(2).all(|two| two[0].0 < two[1].0));
    }
}
