//! The estimated error over time, as a small graph: both axes logarithmic would hide that it has stopped, so that time is not.

use egui::{Color32, Pos2, Rect, RichText, Sense, Shape, Stroke, Ui, vec2};

/// Height, points.
const HEIGHT: f32 = 44.0;
/// Colours of the background, of lines at powers of ten, and of the error.
const GROUND: Color32 = Color32::from_black_alpha(120);
const LINES: Stroke = Stroke { width: 1.0, color: Color32::from_gray(70) };
const CURVE: Stroke = Stroke { width: 1.5, color: Color32::from_rgb(120, 200, 255) };

/// Lays it out for times, seconds, with errors; nothing while there are fewer than two.
pub(super) fn lay_out(ui: &mut Ui, points: &[(f64, f32)]) {
    let Some(axes) = Axes::of(points) else { return };
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), HEIGHT), Sense::hover());
    let painter = ui.painter_at(rect);
    painter.rect_filled(rect, 2.0, GROUND);
    for power in axes.powers[0]..=axes.powers[1] {
        let y = axes.place(rect, (axes.times[0], 10f32.powi(power))).y;
        painter.hline(rect.x_range(), y, LINES);
    }
    painter.add(Shape::line(points.iter().map(|&point| axes.place(rect, point)).collect(), CURVE));
    let percent = |power: i32| format!("{} %", 100.0 * 10f64.powi(power));
    let range = format!("{} to {}", percent(axes.powers[0]), percent(axes.powers[1]));
    response.on_hover_ui(|ui| {
        let seconds = axes.times[1] - axes.times[0];
        ui.label(RichText::new(format!("estimated error over {seconds:.0} s, lines at powers of ten: {range}")));
    });
}

/// What a graph spans.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Axes {
    /// Seconds.
    times: [f64; 2],
    /// Powers of ten of the error.
    powers: [i32; 2],
}

impl Axes {
    fn of(points: &[(f64, f32)]) -> Option<Self> {
        let ((first, _), (last, _)) = (points.first()?, points.last()?);
        let logarithms = || points.iter().map(|(_, error)| error.log10());
        let (least, most) =
            (logarithms().fold(f32::INFINITY, f32::min), logarithms().fold(f32::NEG_INFINITY, f32::max));
        let (floor, ceiling) = (least.floor() as i32, most.ceil() as i32);
        (last > first).then_some(Self { times: [*first, *last], powers: [floor, ceiling.max(floor + 1)] })
    }

    /// Where a time and an error lie.
    fn place(self, rect: Rect, (time, error): (f64, f32)) -> Pos2 {
        let [from, to] = self.times;
        let [low, high] = self.powers.map(|power| power as f32);
        let across = ((time - from) / (to - from)) as f32;
        rect.left_bottom() + vec2(across, -(error.log10() - low) / (high - low)) * rect.size()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_span_what_there_is() {
        assert_eq!(Axes::of(&[]), None);
        assert_eq!(Axes::of(&[(1.0, 0.5)]), None, "a point is no line");
        let axes = Axes::of(&[(1.0, 0.5), (2.0, 0.03), (3.0, 0.02)]).unwrap();
        assert_eq!(axes, Axes { times: [1.0, 3.0], powers: [-2, 0] });
        let rect = Rect::from_min_size(Pos2::new(10.0, 20.0), vec2(100.0, 40.0));
        let place = |point| axes.place(rect, point);
        assert!(place((1.0, 1.0)).distance(Pos2::new(10.0, 20.0)) < 1e-3);
        assert!(place((3.0, 0.01)).distance(Pos2::new(110.0, 60.0)) < 1e-3);
        assert!(place((2.0, 0.1)).distance(Pos2::new(60.0, 40.0)) < 1e-3);
        assert_eq!(Axes::of(&[(0.0, 0.1), (1.0, 0.1)]).unwrap().powers, [-1, 0], "a decade at least");
    }
}
