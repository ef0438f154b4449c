//! Line plots as SVG, on logarithmic axes.

use std::fmt::Write as _;

/// Size in units of the drawing.
const SIZE: [f64; 2] = [460.0, 280.0];
/// Left, top, right and bottom margin.
const MARGIN: [f64; 4] = [84.0, 14.0, 34.0, 42.0];

/// A line.
pub(super) struct Line {
    pub name: &'static str,
    pub points: Vec<[f64; 2]>,
}

/// A scale from values to 0..1.
#[derive(Clone, Copy)]
pub(super) enum Scale {
    /// From, to.
    Linear(f64, f64),
    /// Decades from, to.
    Logarithmic(i32, i32),
}

impl Scale {
    fn at(self, value: f64) -> f64 {
        match self {
            Self::Linear(from, to) => (value - from) / (to - from).max(f64::MIN_POSITIVE),
            // What is below the scale, as 0 is, lies on its floor.
            Self::Logarithmic(from, to) => {
                let decade = if value > 0.0 { value.log10() } else { f64::from(from) };
                ((decade - f64::from(from)) / f64::from(to - from).max(1.0)).clamp(0.0, 1.0)
            }
        }
    }

    fn ticks(self) -> Vec<f64> {
        match self {
            Self::Linear(from, to) => (0..=4).map(|i| (from + (to - from) * f64::from(i) / 4.0).round()).collect(),
            Self::Logarithmic(from, to) => (from..=to).map(|decade| 10f64.powi(decade)).collect(),
        }
    }
}

/// What a plot shows besides its lines.
pub(super) struct Axes<'a> {
    pub title: &'a str,
    pub x: Scale,
    pub y: Scale,
    pub x_label: &'a str,
    pub y_label: &'a str,
    pub y_tick: fn(f64) -> String,
}

/// The colour and dashes of a mode, told apart without colour too \[Okabe08].
pub(super) fn style(mode: &str) -> (&'static str, &'static str) {
    match mode {
        "stencil" => ("#0072b2", ""),
        "id" => ("#009e73", "7 3"),
        "depth-less-equal" => ("#d55e00", ""),
        "depth-equal" => ("#cc79a7", ""),
        "depth-bias" => ("#b8860b", "9 3 2 3"),
        "full" => ("#333333", "2 3"),
        "stencil-export" => ("#56b4e9", "4 2"),
        _ => ("#7b3fb5", "12 4"),
    }
}

/// Draws lines on axes.
pub(super) fn svg(axes: &Axes<'_>, lines: &[Line]) -> String {
    let [width, height] = SIZE;
    let [left, top, right, bottom] = MARGIN;
    let x = |v: f64| left + axes.x.at(v) * (width - left - right);
    let y = |v: f64| height - bottom - axes.y.at(v) * (height - top - bottom);
    let mut text = format!(r#"<svg viewBox="0 0 {width} {height}" role="img" aria-label="{}">"#, axes.title);
    for tick in axes.y.ticks() {
        let (at, end) = (y(tick), width - right);
        let _ = write!(text, r#"<path class="grid" d="M{left} {at:.1}H{end}"/>"#);
        let _ = write!(
            text,
            r#"<text x="{}" y="{:.1}" text-anchor="end">{}</text>"#,
            left - 6.0,
            at + 4.0,
            (axes.y_tick)(tick)
        );
    }
    for tick in axes.x.ticks() {
        let (at, base) = (x(tick), height - bottom);
        let _ = write!(text, r#"<path class="grid" d="M{at:.1} {top}V{base}"/>"#);
        let _ = write!(text, r#"<text x="{at:.1}" y="{}" text-anchor="middle">{}</text>"#, base + 16.0, number(tick));
    }
    let _ = write!(
        text,
        r#"<text x="{:.1}" y="{:.1}" text-anchor="middle">{}</text>"#,
        (left + width - right) / 2.0,
        height - 6.0,
        axes.x_label
    );
    let middle = (top + height - bottom) / 2.0;
    let _ = write!(
        text,
        r#"<text transform="translate(12 {middle:.1}) rotate(-90)" text-anchor="middle">{}</text>"#,
        axes.y_label
    );
    for line in lines {
        text += &polyline(line, x, y);
    }
    text + "</svg>"
}

fn polyline(line: &Line, x: impl Fn(f64) -> f64, y: impl Fn(f64) -> f64) -> String {
    let (colour, dashes) = style(line.name);
    let points: Vec<String> = line.points.iter().map(|p| format!("{:.1},{:.1}", x(p[0]), y(p[1]))).collect();
    format!(
        r#"<polyline points="{}" fill="none" stroke="{colour}" stroke-width="2" stroke-dasharray="{dashes}"><title>{}</title></polyline>"#,
        points.join(" "),
        line.name
    )
}

/// A whole number with thousands set apart.
pub(super) fn number(value: f64) -> String {
    let digits = format!("{value:.0}");
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

/// The decades that positive values span, at least one.
pub(super) fn decades(values: impl Iterator<Item = f64>) -> (i32, i32) {
    let (low, high) = values.filter(|v| *v > 0.0).fold((f64::INFINITY, 0.0_f64), |(l, h), v| (l.min(v), h.max(v)));
    if high == 0.0 {
        return (0, 1);
    }
    let (from, to) = (low.log10().floor() as i32, high.log10().ceil() as i32);
    (from, to.max(from + 1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scales_and_numbers() {
        assert_eq!(decades([0.0, 0.02, 400.0].into_iter()), (-2, 3));
        assert_eq!(decades([0.0].into_iter()), (0, 1));
        assert_eq!(
            (number(10.0), number(10_000.0), number(1_234_567.0)),
            ("10".into(), "10,000".into(), "1,234,567".into())
        );
        let scale = Scale::Logarithmic(-2, 2);
        assert_eq!([0.0, 1e-9, 1.0, 100.0].map(|v| scale.at(v)), [0.0, 0.0, 0.5, 1.0]);
    }

    #[test]
    fn every_point_lies_within_the_drawing() {
        let axes = Axes {
            title: "t",
            x: Scale::Linear(0.0, 4.0),
            y: Scale::Logarithmic(-6, 0),
            x_label: "x",
            y_label: "y",
            y_tick: |v| v.to_string(),
        };
        let text = svg(&axes, &[Line { name: "id", points: vec![[0.0, 0.0], [4.0, 1.0]] }]);
        assert!(text.contains(r#"points="84.0,238.0 426.0,14.0""#), "{text}");
    }
}
