//! A log-log plot as SVG.

use std::fmt::Write as _;

/// A line of the plot.
#[derive(Clone, Debug)]
pub struct Line<'a> {
    /// What it is called in the legend.
    pub name: &'a str,
    /// x and y; points that have no logarithm break the line.
    pub points: Vec<(f64, f64)>,
    /// Colour, as SVG writes it.
    pub colour: &'a str,
    /// Whether it is measured (drawn through, with its points), or a guide (dashed).
    pub measured: bool,
}

/// Width and height, and the margins left, right, above and below the axes, SVG units.
const SIZE: [f64; 2] = [720.0, 480.0];
const MARGINS: [f64; 4] = [70.0, 20.0, 40.0, 50.0];
/// Decades of an axis at most: what is smaller than the largest value by more than that is no longer of interest.
const MOST_DECADES: i32 = 8;

/// An axis: whole decades between two pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Axis {
    decades: [i32; 2],
    ends: [f64; 2],
}

impl Axis {
    /// The decades that hold all values; 1 to 10 without any.
    fn of(values: impl Iterator<Item = f64>, ends: [f64; 2]) -> Self {
        let logarithms: Vec<f64> = values.filter(|v| v.is_normal() && *v > 0.0).map(f64::log10).collect();
        let least = logarithms.iter().copied().fold(f64::INFINITY, f64::min);
        let most = logarithms.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        if logarithms.is_empty() {
            return Self { decades: [0, 1], ends };
        }
        let high = (most.ceil() as i32).max(least.floor() as i32 + 1);
        Self { decades: [(least.floor() as i32).max(high - MOST_DECADES), high], ends }
    }

    /// Where a value lies; `None` if it has no logarithm or is off the axis.
    fn at(&self, value: f64) -> Option<f64> {
        let [low, high] = self.decades.map(f64::from);
        let share = (value.log10() - low) / (high - low);
        (-1e-9..=1.0 + 1e-9).contains(&share).then(|| self.ends[0] + share * (self.ends[1] - self.ends[0]))
    }

    /// Where the lines of its grid are: whole decades with their exponents, and 2 to 9 between.
    fn grid(&self) -> Vec<(f64, Option<i32>)> {
        let of_decade =
            |decade: i32| (1..10).map(move |i| (f64::from(i) * 10_f64.powi(decade), (i == 1).then_some(decade)));
        let values = (self.decades[0]..=self.decades[1]).flat_map(of_decade);
        values.filter_map(|(value, decade)| self.at(value).map(|at| (at, decade))).collect()
    }
}

/// Draws lines over logarithmic axes.
#[must_use]
pub fn log_log(title: &str, [x_label, y_label]: [&str; 2], lines: &[Line<'_>]) -> String {
    let [width, height] = SIZE;
    let [left, right, top, bottom] = MARGINS;
    let all = || lines.iter().flat_map(|line| &line.points).filter(|(x, y)| *x > 0.0 && *y > 0.0);
    let x = Axis::of(all().map(|p| p.0), [left, width - right]);
    let y = Axis::of(all().map(|p| p.1), [height - bottom, top]);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\" \
         font-family=\"sans-serif\" font-size=\"13\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
    );
    let mut text = |at: [f64; 2], anchor: &str, more: &str, text: &str| {
        let [x, y] = at;
        let _ =
            writeln!(svg, "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\"{more}>{}</text>", escaped(text));
    };
    text([width / 2.0, 24.0], "middle", " font-size=\"15\"", title);
    text([(left + width - right) / 2.0, height - 12.0], "middle", "", x_label);
    let middle = (top + height - bottom) / 2.0;
    text([18.0, middle], "middle", &format!(" transform=\"rotate(-90 18 {middle:.1})\""), y_label);
    svg += &grid(&x, &y);
    for (i, line) in lines.iter().enumerate() {
        svg += &drawn(line, &x, &y);
        svg += &legend(line, [width - right - 190.0, top + 18.0 + 18.0 * i as f64]);
    }
    svg + "</svg>\n"
}

fn grid(x: &Axis, y: &Axis) -> String {
    let mut svg = String::new();
    let ([left, right], [bottom, top]) = (x.ends, y.ends);
    let shade = |decade: Option<i32>| if decade.is_some() { "#bbbbbb" } else { "#eeeeee" };
    for (at, decade) in x.grid() {
        let _ = writeln!(svg, "<path d=\"M{at:.1} {bottom}V{top}\" stroke=\"{}\"/>", shade(decade));
        if let Some(decade) = decade {
            let y = bottom + 18.0;
            let _ = writeln!(svg, "<text x=\"{at:.1}\" y=\"{y:.1}\" text-anchor=\"middle\">{}</text>", power(decade));
        }
    }
    for (at, decade) in y.grid() {
        let _ = writeln!(svg, "<path d=\"M{left} {at:.1}H{right}\" stroke=\"{}\"/>", shade(decade));
        if let Some(decade) = decade {
            let (x, y) = (left - 6.0, at + 4.0);
            let _ = writeln!(svg, "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"end\">{}</text>", power(decade));
        }
    }
    svg
}

fn drawn(line: &Line<'_>, x: &Axis, y: &Axis) -> String {
    let mut svg = String::new();
    let at: Vec<Option<(f64, f64)>> = line.points.iter().map(|p| x.at(p.0).zip(y.at(p.1))).collect();
    let dashes = if line.measured { "" } else { " stroke-dasharray=\"6 5\"" };
    for run in at.split(Option::is_none) {
        let points: Vec<String> = run.iter().flatten().map(|(x, y)| format!("{x:.1},{y:.1}")).collect();
        let (points, colour) = (points.join(" "), line.colour);
        let _ = writeln!(
            svg,
            "<polyline points=\"{points}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"2\"{dashes}/>"
        );
    }
    for (x, y) in at.iter().flatten().filter(|_| line.measured) {
        let _ = writeln!(svg, "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"3\" fill=\"{}\"/>", line.colour);
    }
    svg
}

fn legend(line: &Line<'_>, [x, y]: [f64; 2]) -> String {
    let (name, colour, end, text, middle) = (escaped(line.name), line.colour, x + 24.0, x + 30.0, y - 4.0);
    let dashes = if line.measured { "" } else { " stroke-dasharray=\"6 5\"" };
    format!(
        "<path d=\"M{x:.1} {middle:.1}H{end:.1}\" stroke=\"{colour}\" stroke-width=\"2\"{dashes}/>\n<text x=\"{text:.1}\" \
         y=\"{y:.1}\">{name}</text>\n"
    )
}

/// 10ⁿ with the exponent raised.
fn power(exponent: i32) -> String {
    let sign = if exponent < 0 { "−" } else { "" };
    format!("10<tspan dy=\"-5\" font-size=\"10\">{sign}{}</tspan>", exponent.abs())
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_hold_all_values_by_whole_decades() {
        let axis = |values: &[f64]| Axis::of(values.iter().copied(), [100.0, 300.0]);
        assert_eq!(axis(&[0.02, 3.0]).decades, [-2, 1]);
        assert_eq!(axis(&[1.0]).decades, [0, 1]);
        assert_eq!(axis(&[f64::NAN, 0.0, -1.0]).decades, [0, 1]);
        assert_eq!(axis(&[1e-30, 5.0]).decades, [1 - MOST_DECADES, 1]);
        let two = axis(&[0.1, 10.0]);
        assert_eq!([0.1, 1.0, 10.0].map(|v| two.at(v).map(f64::round)), [Some(100.0), Some(200.0), Some(300.0)]);
        assert_eq!([0.0, -1.0, 0.09, 11.0, f64::NAN].map(|v| two.at(v)), [None; 5]);
        let (lines, decades) = (two.grid(), two.grid().into_iter().filter_map(|(_, d)| d).collect::<Vec<_>>());
        assert_eq!((lines.len(), decades), (19, vec![-1, 0, 1]));
    }

    #[test]
    fn what_has_no_logarithm_breaks_the_line_and_text_is_text() {
        let points = vec![(0.1, 1.0), (1.0, 0.1), (2.0, -0.01), (10.0, 0.01)];
        let line = Line { name: "a < b & c", points, colour: "#123456", measured: true };
        let svg = log_log("title", ["x", "y"], &[line]);
        assert_eq!((svg.matches("<polyline").count(), svg.matches("<circle").count()), (2, 3));
        assert!(svg.contains("a &lt; b &amp; c") && !svg.contains("NaN"), "{svg}");
        assert!(svg.starts_with("<svg ") && svg.ends_with("</svg>\n"));
    }
}
