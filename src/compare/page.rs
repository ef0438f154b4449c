//! The report as one HTML file that needs nothing else: figures, plots, pictures.

use super::pictures::Pictures;
use super::plot::{Axes, Line, Scale, decades, number, style, svg};
use super::report::{CLEAN_FOREIGN, CLEAN_MISSED, ModeRow, Report, percent};
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD as BASE64;
use std::fmt::Write as _;

/// The pictures of a mode from one camera.
pub struct Shot {
    /// The tilt.
    pub tilt: &'static str,
    /// The mode.
    pub mode: &'static str,
    /// Its pictures.
    pub pictures: Pictures,
}

/// Least decade of the plot of artefacts: a pixel of a million.
const FLOOR: i32 = -6;

/// The page; `shots` are those of the first depth format.
#[must_use]
pub fn html(report: &Report, shots: &[Shot]) -> String {
    let title = format!("Update modes: {}", escape(&report.scene));
    let mut text = format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" \
         content=\"width=device-width, initial-scale=1\">\n<title>{title}</title>\n<style>\n{}</style>\n</head>\n<body>\n",
        include_str!("page.css")
    );
    text += &heading(report, &title);
    text += &cards(report);
    text += &summary_table(report);
    text += &plots(report);
    text += &pictures(report, shots);
    text += &details(report);
    text += &setting(report);
    let _ = write!(text, "<script>\n{}</script>\n</body>\n</html>\n", include_str!("page.js"));
    text
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

fn heading(report: &Report, title: &str) -> String {
    let device = report.device.as_ref().map_or_else(String::new, |d| escape(&d.name));
    let mut text = format!(
        "<h1>{title}</h1>\n<p class=\"soft\">{device}, {}×{} pixels, {} updates of one refinement replayed in each mode, depth and \
         tilt.</p>\n",
        report.size[0], report.size[1], report.updates
    );
    if report.interrupted {
        text += "<p class=\"bad\"><b>The run was interrupted: what follows is incomplete.</b></p>\n";
    }
    for line in &report.exceeded {
        let _ = writeln!(text, "<p class=\"bad\"><b>{}</b></p>", escape(line));
    }
    text
}

/// What a reader takes away in ten seconds.
fn cards(report: &Report) -> String {
    let mut cards = Vec::new();
    if let (Some(best), Some(patches)) = (report.best(), report.quoted_patches()) {
        let ms = report.cost(best, patches).unwrap_or(0.0);
        let text = format!("the cheapest mode without artefacts: {ms:.1} ms for {} patches", number(patches as f64));
        cards.push(("good", best.to_owned(), text));
    }
    for mode in ["stencil", "depth-less-equal", "depth-equal"] {
        if let Some(worst) = report.worst(mode) {
            let clean = report.is_clean(mode);
            let text = format!(
                "of the pixels to update missed at most by <code>{mode}</code>, {} foreign",
                percent(worst.foreign)
            );
            cards.push((if clean { "good" } else { "bad" }, percent(worst.missed), text));
        }
    }
    if let Some(ratio) = cost_ratio(report) {
        cards.push((
            "",
            format!("{ratio:.2} ×"),
            "the cost of <code>stencil</code> against <code>id</code>".to_owned(),
        ));
    }
    let card = |(class, figure, text): &(&str, String, String)| {
        format!("<div class=\"card {class}\"><b>{figure}</b>{text}</div>\n")
    };
    format!("<div class=\"cards\">\n{}</div>\n", cards.iter().map(card).collect::<String>())
}

fn cost_ratio(report: &Report) -> Option<f64> {
    let patches = report.quoted_patches()?;
    let id = report.cost("id", patches)?;
    (id > 0.0).then_some(report.cost("stencil", patches)? / id)
}

/// A sample of a mode's line.
fn key(mode: &str) -> String {
    let (colour, dashes) = style(mode);
    let border = if dashes.is_empty() { "solid" } else { "dashed" };
    format!("<span class=\"key\" style=\"border-top-style:{border};border-top-color:{colour}\"></span>{mode}")
}

fn summary_table(report: &Report) -> String {
    let counts: Vec<usize> = cost_counts(report);
    let unit = if report.costs_are_cpu() { "CPU milliseconds" } else { "milliseconds of the device" };
    let costs: String = counts.iter().map(|&n| format!("<th>ms for {}</th>", number(n as f64))).collect();
    let mut text = format!(
        "<h2>All modes</h2>\n<p>The worst over all depth formats and tilts, in shares of the pixels that an update had to change; stale \
         and wrong pixels (off by more than 2 %) in shares of the picture after the last update. Green is within what cracks between \
         triangles leave: {} missed, {} foreign. Costs are {unit} of updates of so many patches.</p>\n<div class=\"scroll\"><table>\n<tr><th>mode</th><th>missed</th><th>foreign</th>\
         <th>double</th><th>stale</th><th>wrong</th><th>mean error</th><th>FLIP</th>{costs}</tr>\n",
        percent(CLEAN_MISSED),
        percent(CLEAN_FOREIGN)
    );
    for mode in report.compared() {
        let Some(w) = report.worst(mode) else { continue };
        let cell = |share: f64, limit: f64| {
            format!("<td class=\"{}\">{}</td>", if share <= limit { "good" } else { "bad" }, percent(share))
        };
        let plain: String = [w.double, w.stale, w.wrong, w.relative_error]
            .iter()
            .map(|&s| format!("<td>{}</td>", percent(s)))
            .collect();
        let costs: String = counts
            .iter()
            .map(|&n| report.cost(mode, n).map_or_else(|| "<td></td>".to_owned(), |ms| format!("<td>{ms:.2}</td>")))
            .collect();
        let (missed, foreign) = (cell(w.missed, CLEAN_MISSED), cell(w.foreign, CLEAN_FOREIGN));
        let _ = writeln!(text, "<tr><td>{}</td>{missed}{foreign}{plain}<td>{:.4}</td>{costs}</tr>", key(mode), w.flip);
    }
    text + "</table></div>\n"
}

fn cost_counts(report: &Report) -> Vec<usize> {
    let mut counts: Vec<usize> = report.costs.iter().map(|row| row.patches).collect();
    counts.sort_unstable();
    counts.dedup();
    counts
}

fn plots(report: &Report) -> String {
    let legend: String = report.compared().iter().map(|mode| format!("<span>{}</span>", key(mode))).collect();
    let mut text = format!(
        "<h2>Artefacts over updates, cost over patches</h2>\n<div class=\"legend\">{legend}</div>\n<div class=\"plots\">\n"
    );
    let depth = report.modes.first().map(ModeRow::depth).unwrap_or_default();
    for tilt in &report.tilts {
        let rows = report.modes.iter().filter(|row| row.tilt == tilt.name && row.depth() == depth);
        let lines: Vec<Line> = rows.map(stale_line).collect();
        let axes = Axes {
            title: "stale pixels over updates",
            x: Scale::Linear(0.0, report.updates.max(1) as f64),
            y: Scale::Logarithmic(FLOOR, 0),
            x_label: "updates",
            y_label: "stale pixels",
            y_tick: |v| if v <= 10f64.powi(FLOOR) { "≤ 0.0001 %".to_owned() } else { percent(v) },
        };
        let _ = writeln!(
            text,
            "<figure>{}<figcaption>{}, {:.0}° from the normal, {depth}: share of the picture that shows triangles which are no \
             longer part of the mesh</figcaption></figure>",
            svg(&axes, &lines),
            tilt.name,
            tilt.degrees
        );
    }
    text += &cost_plot(report);
    text + "</div>\n"
}

fn stale_line(row: &ModeRow) -> Line {
    Line { name: row.mode, points: row.steps.iter().map(|s| [s.update as f64, s.stale_fraction]).collect() }
}

fn cost_plot(report: &Report) -> String {
    if report.costs.is_empty() {
        return String::new();
    }
    let counts = cost_counts(report);
    let lines: Vec<Line> = report
        .compared()
        .into_iter()
        .map(|name| {
            let points = counts.iter().filter_map(|&n| report.cost(name, n).map(|ms| [n as f64, ms])).collect();
            Line { name, points }
        })
        .collect();
    let (x0, x1) = decades(counts.iter().map(|&n| n as f64));
    let (y0, y1) = decades(lines.iter().flat_map(|line| line.points.iter().map(|p| p[1])));
    let unit = if report.costs_are_cpu() { "CPU milliseconds" } else { "GPU milliseconds" };
    let axes = Axes {
        title: "cost over patches",
        x: Scale::Logarithmic(x0, x1),
        y: Scale::Logarithmic(y0, y1),
        x_label: "patches of an update",
        y_label: unit,
        y_tick: |v| if v < 1.0 { format!("{v}") } else { number(v) },
    };
    format!(
        "<figure>{}<figcaption>cost of an update, each patch a triangle split in four: medians of {} interleaved runs</figcaption>\
         </figure>\n",
        svg(&axes, &lines),
        report.cost_runs
    )
}

/// The kinds of pictures, by the ends of their names.
const KINDS: [(&str, &str); 4] =
    [("mask-part", "mask, enlarged"), ("image-part", "picture, enlarged"), ("mask", "mask"), ("image", "picture")];

fn pictures(report: &Report, shots: &[Shot]) -> String {
    let mut text = String::from(
        "<h2>Pictures and masks</h2>\n<p class=\"soft\">After the last update. In masks \
         <span class=\"swatch\" style=\"background:#d55e00\"></span>stale\
         <span class=\"swatch\" style=\"background:#0096e6\"></span>another face\
         <span class=\"swatch\" style=\"background:#f0e442\"></span>off by more than 2 %</p>\n",
    );
    for tilt in &report.tilts {
        let shots: Vec<&Shot> = shots.iter().filter(|shot| shot.tilt == tilt.name).collect();
        if shots.is_empty() {
            continue;
        }
        let _ = writeln!(text, "<h3>{}, {:.0}°</h3>", tilt.name, tilt.degrees);
        text += &viewer(tilt.name, &shots);
        text += "<div class=\"grid-of-parts\">\n";
        for shot in shots {
            text += &thumbnails(shot);
        }
        text += "</div>\n";
    }
    text
}

fn viewer(tilt: &str, shots: &[&Shot]) -> String {
    let worst =
        ["depth-equal", "depth-less-equal"].into_iter().find(|mode| shots.iter().any(|shot| shot.mode == *mode));
    let options = |chosen: Option<&str>| -> String {
        let option = |shot: &&Shot| {
            let selected = if chosen == Some(shot.mode) { " selected" } else { "" };
            format!("<option{selected}>{}</option>", shot.mode)
        };
        shots.iter().map(option).collect()
    };
    let kinds: String =
        KINDS.iter().map(|(value, label)| format!("<option value=\"{value}\">{label}</option>")).collect();
    format!(
        "<div class=\"viewer\" data-tilt=\"{tilt}\">\n<div class=\"controls\"><label>left <select data-role=\"left\">{}</select></label>\
         <label>right <select data-role=\"right\">{}</select></label>\
         <label>show <select data-role=\"kind\">{kinds}</select></label></div>\n\
         <div class=\"stage\"><img alt=\"\"><img alt=\"\"></div>\n\
         <input type=\"range\" min=\"0\" max=\"100\" value=\"50\" data-role=\"slider\" aria-label=\"where the pictures meet\">\n</div>\n",
        options(worst),
        options(shots.first().map(|shot| shot.mode))
    )
}

/// The enlarged part of a mode, seen by all; the viewer takes its pictures from here.
fn thumbnails(shot: &Shot) -> String {
    let Pictures { image, mask, image_part, mask_part } = &shot.pictures;
    let picture = |kind: &str, bytes: &[u8], hidden: &str| {
        format!(
            "<img id=\"{}/{}/{kind}\" alt=\"{} of {}, {}\"{hidden} src=\"data:image/png;base64,{}\">",
            shot.tilt,
            shot.mode,
            kind,
            shot.mode,
            shot.tilt,
            BASE64.encode(bytes)
        )
    };
    let hidden = " hidden loading=\"lazy\"";
    format!(
        "<figure>{}{}{}{}<figcaption>{}</figcaption></figure>\n",
        picture("image-part", image_part, ""),
        picture("mask-part", mask_part, ""),
        picture("image", image, hidden),
        picture("mask", mask, hidden),
        shot.mode
    )
}

fn details(report: &Report) -> String {
    let mut text = String::from(
        "<h2>Every mode, depth and tilt</h2>\n<details><summary>The table behind the worst (also in artefacts.csv and report.json)</summary>\n\
         <div class=\"scroll\"><table>\n<tr><th>mode</th><th>tilt</th><th>depth</th><th>pixels to update</th><th>missed</th><th>foreign</th>\
         <th>double</th><th>stale</th><th>wrong</th><th>within 0.1 %</th><th>max error</th><th>FLIP</th><th>ms an update</th><th>draws</th></tr>\n",
    );
    for r in &report.modes {
        let shares = [
            r.missed_fraction,
            r.foreign_fraction,
            r.double_fraction,
            r.stale_fraction,
            r.wrong_fraction,
            r.close_fraction,
        ];
        let shares: String = shares.iter().map(|&s| format!("<td>{}</td>", percent(s))).collect();
        let _ = writeln!(
            text,
            "<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td>{shares}<td>{:.3}</td><td>{:.4}</td><td>{:.2}</td><td>{}</td></tr>",
            r.mode,
            r.tilt,
            r.depth(),
            number(r.updated_pixels as f64),
            r.max_error,
            r.flip,
            r.luminance_ms_median,
            r.draws
        );
    }
    text + "</table></div>\n</details>\n"
}

fn setting(report: &Report) -> String {
    let mut rows = vec![("command", format!("<code>{}</code>", escape(&report.command.join(" "))))];
    if let Some(device) = &report.device {
        rows.push(("device", format!("{} ({})", escape(&device.name), device.kind)));
        rows.push(("driver", format!("{}, Vulkan {}", escape(&device.driver), device.api_version)));
        let optional = &device.optional;
        rows.push(("vertices snap to", format!("2<sup>−{}</sup> pixel", optional.sub_pixel_bits)));
        rows.push(("depth formats", optional.depth_formats.join(", ")));
        rows.push(("luminance, ids", format!("{}, {}", device.formats.colour, device.formats.id)));
    }
    let tilts = report.tilts.iter().map(|t| {
        let (name, degrees, patches) = (t.name, t.degrees, number(t.patches as f64));
        format!("{name} {degrees:.0}°, near plane {:.3} scene units, {patches} patches", t.near)
    });
    rows.push(("cameras", tilts.collect::<Vec<_>>().join("; ")));
    rows.push((
        "recording",
        format!(
            "{} updates of {} rays, compared every {}, seed {}",
            report.updates,
            number(report.rays as f64),
            report.every,
            report.seed
        ),
    ));
    rows.push(("version", format!("penombre {}, {:.0} s", report.version, report.seconds)));
    let mut text = String::from("<h2>How it was measured</h2>\n<dl>\n");
    for (name, value) in rows {
        let _ = writeln!(text, "<dt>{name}</dt><dd>{value}</dd>");
    }
    text += "</dl>\n";
    for refusal in &report.refused {
        let _ = writeln!(text, "<p class=\"soft\">Not compared: {}</p>", escape(refusal));
    }
    text + "<footer>What the words mean, where the artefacts come from and which mode to choose: docs/update-modes.md of Penombre.</footer>\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_by_others_is_escaped() {
        let report = Report { scene: "<b>&\"".to_owned(), command: vec!["<i>".to_owned()], ..Report::default() };
        let page = html(&report, &[]);
        assert!(page.contains("&lt;b&gt;&amp;&quot;") && page.contains("&lt;i&gt;") && !page.contains("<b>&\""));
    }

    #[test]
    fn nothing_is_fetched() {
        let shot = Shot { tilt: "frontal", mode: "id", pictures: Pictures::default() };
        let page = html(&Report::default(), &[shot]);
        assert!(!page.contains("http") && !page.contains("src=\"/") && !page.contains("@import"));
    }
}
