//! When an error falls below a target, between measured points.

/// When an error is down to a target for good.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// The time.
    pub at: f64,
    /// Whether it may have been so before: nothing was measured earlier.
    pub at_most: bool,
}

/// Where errors over rising times are down to `target` for good, between points by the straight line of their logarithms; the first
/// point's time if they start there, `None` if the last is above. An error at or below 0 is lost in noise: there the point's own time counts.
#[must_use]
pub fn crossing(points: &[(f64, f64)], target: f64) -> Option<Crossing> {
    let Some(above) = points.iter().rposition(|&(_, error)| error > target) else {
        return points.first().map(|&(at, _)| Crossing { at, at_most: true });
    };
    let ((before, high), (after, low)) = (points[above], *points.get(above + 1)?);
    if low <= 0.0 {
        return Some(Crossing { at: after, at_most: false });
    }
    let share = (high / target).ln() / (high / low).ln();
    Some(Crossing { at: before * (after / before).powf(share), at_most: false })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn close(points: &[(f64, f64)], target: f64, expected: f64) {
        let found = crossing(points, target).expect("it is reached");
        assert!((found.at / expected - 1.0).abs() < 1e-9, "{found:?} is not {expected}");
    }

    #[test]
    fn straight_lines_of_logarithms_are_followed() {
        let halving = [(1.0, 1.0), (4.0, 0.25), (16.0, 0.0625)];
        close(&halving, 0.5, 2.0);
        close(&halving, 0.125, 8.0);
        close(&halving, 0.0625, 16.0);
        assert_eq!(crossing(&halving, 2.0), Some(Crossing { at: 1.0, at_most: true }));
        assert_eq!((crossing(&halving, 0.06), crossing(&[], 1.0)), (None, None));
        // Down for good only after it has risen once more; below the noise it is nowhere in particular.
        close(&[(1.0, 1.0), (2.0, 0.1), (3.0, 1.0), (6.0, 0.5)], 0.5, 6.0);
        close(&[(1.0, 1.0), (2.0, -0.1)], 0.5, 2.0);
    }
}
