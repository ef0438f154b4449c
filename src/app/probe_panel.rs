//! The panel that explains a pixel, as readable text.

use crate::math::luminance;
use crate::refine::explanation::{Explanation, Known, LightPart, Vertex};
use crate::session::Probe;
use egui::{Align2, Context, Frame, RichText, ScrollArea, Window};
use glam::Vec3;

/// Distance from the window's edge, points.
const MARGIN: f32 = 8.0;
/// Width at most, points.
const WIDTH: f32 = 700.0;
/// Lights that are listed, those that add most.
const LISTED: usize = 8;
/// Light that is not worth a line, against the whole.
const NEGLIGIBLE: f32 = 1e-3;

/// Lines under a heading.
struct Section {
    heading: String,
    lines: Vec<String>,
}

/// Lays the panel out, at the right.
pub fn lay_out(context: &Context, probe: &Probe, frame: Frame) {
    let room = context.content_rect().size() - egui::Vec2::splat(4.0 * MARGIN);
    let panel = Window::new("pixel")
        .title_bar(false)
        .resizable(false)
        .frame(frame)
        .default_size(room.min([WIDTH, room.y].into()));
    panel.anchor(Align2::RIGHT_TOP, [-MARGIN, MARGIN]).show(context, |ui| {
        ScrollArea::both().max_height(room.y).show(ui, |ui| {
            for Section { heading, lines } in sections(probe) {
                ui.strong(heading);
                for line in lines {
                    ui.add(egui::Label::new(RichText::new(line).monospace()).extend());
                }
            }
            ui.weak("Alt + click on it again, or Esc, closes; `pixel.save` writes all of it");
        });
    });
}

/// All that is said.
fn sections(probe: &Probe) -> Vec<Section> {
    let mut all = vec![pixel(probe)];
    if let Some(surface) = &probe.surface {
        all.push(place(surface));
        all.push(parts(probe));
        all.extend(surface.vertices.iter().zip(1..).map(|(at, number)| vertex(at, number)));
    }
    all
}

fn pixel(Probe { pixel: [x, y], image, colours, notes, .. }: &Probe) -> Section {
    let mut lines = vec![
        format!("radiance   {}  W/sr/m²", colour(image.radiance)),
        format!("k_d        {}", colour(colours.kd)),
        format!("k_s        {}", colour(colours.ks)),
        format!("D          {}", colour(image.light.diffuse)),
        format!("S          {}", colour(image.light.specular)),
    ];
    lines.extend(notes.iter().map(|note| format!("! {note}")));
    Section { heading: format!("Pixel {x} {y}"), lines }
}

/// The triangles that the pixel lies in.
fn place(Explanation { face, nodes, leaf, state, triangle, .. }: &Explanation) -> Section {
    let path: Vec<String> = nodes.iter().filter_map(|node| node.part).map(|part| part.to_string()).collect();
    let path = if path.is_empty() { "not split".to_owned() } else { format!("parts {}", path.join(" ")) };
    let flat = triangle.as_ref().is_some_and(|triangle| triangle.flat);
    let lines = vec![
        format!("triangle {} {}, level {}, {path}", face.triangle, face.side, nodes.len().saturating_sub(1)),
        format!(
            "{:.0} pixels, contrast {:.3}{}",
            leaf.pixels,
            leaf.contrast,
            if flat { ", one value all over" } else { "" }
        ),
        format!(
            "errors: interpolation {}, noise {}, indirect {}",
            number(leaf.interpolation_error),
            number(leaf.noise_error),
            leaf.indirect_error.map_or_else(|| "?".to_owned(), number)
        ),
        format!("view {}, update {}, {} rays", state.view, state.update, state.rays),
    ];
    Section { heading: face.material.clone(), lines }
}

/// Radiance by light, the most first.
fn parts(Probe { radiance, .. }: &Probe) -> Section {
    let mut named: Vec<(String, Vec3)> =
        radiance.lights.iter().map(|part| (names(&part.lights), part.radiance)).collect();
    named.sort_by(|a, b| luminance(b.1).total_cmp(&luminance(a.1)));
    let others: Vec3 = named.iter().skip(LISTED).map(|(_, radiance)| *radiance).sum();
    named.truncate(LISTED);
    let rest = [
        ("other lights", others),
        ("indirect", radiance.indirect),
        ("emitted", radiance.emission),
        ("since changed", radiance.unaccounted),
    ];
    let counts = |radiance: Vec3, whole: Vec3| luminance(radiance.abs()) > NEGLIGIBLE * luminance(whole);
    named.extend(
        rest.into_iter().filter(|part| counts(part.1, radiance.sum)).map(|(name, part)| (name.to_owned(), part)),
    );
    named.push(("sum".to_owned(), radiance.sum));
    let lines = named.iter().map(|(name, radiance)| format!("{name:<16.16} {}", colour(*radiance)));
    Section { heading: "Radiance by light".to_owned(), lines: lines.collect() }
}

fn vertex(vertex: &Vertex, number_of_it: usize) -> Section {
    let kind = format!("{:?}", vertex.kind).to_lowercase();
    let states = [(vertex.covered, "covered"), (vertex.enclosed, "enclosed"), (!vertex.visited, "never visited")];
    let states: String = states.iter().filter(|state| state.0).map(|state| format!(", {}", state.1)).collect();
    let heading = format!("Vertex {number_of_it}: {kind}, {:.1} % of the pixel{states}", vertex.share * 100.0);
    let mut lines = vec![format!("at {}", colour(vertex.position))];
    let mut lights: Vec<&LightPart> = vertex.lights.iter().collect();
    lights.sort_by(|a, b| luminance(b.light.diffuse).total_cmp(&luminance(a.light.diffuse)));
    lines.extend(lights.into_iter().take(LISTED).map(light));
    let indirect = &vertex.indirect;
    lines.push(format!("{:<16} D {}  {}", "indirect", colour(indirect.light.diffuse), indirect.shown_as));
    let gathered = indirect.gathered.map(|own| format!("  {} rays found  {}", indirect.rays, colour(own.diffuse)));
    lines.extend(gathered);
    lines.extend(indirect.predicted.map(|light| format!("  predicted      {}", colour(light.diffuse))));
    lines.push(format!("  kept           {} ± {}", colour(indirect.kept), number(indirect.kept_error)));
    lines.extend(vertex.unchanged_updates.map(|updates| format!("unchanged for {updates} updates")));
    Section { heading, lines }
}

fn light(part: &LightPart) -> String {
    let known = match part.known {
        Known::Traced => format!("{} points", part.points),
        Known::Inferred => "inferred".to_owned(),
        Known::Deferred => "deferred".to_owned(),
        Known::Guessed => "guessed".to_owned(),
        Known::Unknown => "unknown".to_owned(),
    };
    let specular = part.light.specular;
    let specular = if specular == Vec3::ZERO { String::new() } else { format!("  S {}", colour(specular)) };
    let (name, visible) = (names(&part.lights), part.visible * 100.0);
    format!(
        "{name:<16.16} D {} ± {}  {visible:.0} % seen, {known}{specular}",
        colour(part.light.diffuse),
        number(part.error)
    )
}

fn names(lights: &[String]) -> String {
    match lights {
        [one] => one.clone(),
        [first, others @ ..] => format!("{first} + {}", others.len()),
        [] => String::new(),
    }
}

fn colour(value: Vec3) -> String {
    value.to_array().map(|channel| format!("{:>9}", number(channel))).join(" ")
}

/// A number with four digits.
fn number(value: f32) -> String {
    let size = value.abs();
    match () {
        () if value == 0.0 => "0".to_owned(),
        () if !(1e-3..1e5).contains(&size) => format!("{value:.2e}"),
        () => format!("{value:.*}", (3 - size.log10().floor() as i32).clamp(0, 6) as usize),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_four_digits() {
        let all = [0.0, 1.0, -0.123_45, 0.001_234_5, 98.765, 12_345.6, 1.5e-5, 2e7].map(number);
        assert_eq!(all, ["0", "1.000", "-0.1235", "0.001234", "98.76", "12346", "1.50e-5", "2.00e7"]);
    }

    #[test]
    fn lights_that_share_a_group_are_one_name() {
        let names = |all: &[&str]| names(&all.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>());
        assert_eq!([names(&["lamp"]), names(&["a", "b", "c"]), names(&[])], ["lamp", "a + 2", ""]);
    }
}
