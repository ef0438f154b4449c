//! The panel with figures and settings, messages, and the help. What is clicked comes out as commands.

use super::command::{Command, operator_name};
use super::probe_panel;
use super::table::{ENTRIES, Entry};
use super::trigger::labels;
use super::viewer::Viewer;
use crate::refine::update::EngineStats;
use crate::scene::ToneMapping;
use egui::{Align2, Color32, Context, Frame, Grid, RichText, ScrollArea, Slider, Ui, Window};
use winit::keyboard::KeyCode;

/// Range of the exposure's slider, stops.
const STOPS: std::ops::RangeInclusive<f32> = -10.0..=10.0;
/// Range of a light's slider, a factor on its power in the scene.
const POWER: std::ops::RangeInclusive<f32> = 0.0..=4.0;
/// Distance of panels from the window's edge, points.
const MARGIN: f32 = 8.0;
/// Width of the panel, points.
const WIDTH: f32 = 230.0;
/// Size of the help where the window is large enough, points.
const HELP: egui::Vec2 = egui::vec2(980.0, 640.0);
/// Height of the list of lights at most, points.
const LIST: f32 = 260.0;

/// How fast pictures come.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rate {
    /// Pictures a second.
    pub pictures: f64,
    /// Milliseconds that the last took, without waiting for the display.
    pub frame_ms: f64,
    /// Rays a second.
    pub rays: f64,
}

/// Lays the panels out; what was clicked. `printed` tells what is printed on a key.
pub fn lay_out(
    context: &Context,
    viewer: &Viewer,
    rate: Rate,
    printed: &dyn Fn(KeyCode) -> Option<String>,
) -> Vec<Command> {
    let mut commands = Vec::new();
    if viewer.open().hud {
        let panel = Window::new("penombre").title_bar(false).resizable(false).default_width(WIDTH).frame(frame());
        panel.anchor(Align2::LEFT_TOP, [MARGIN, MARGIN]).show(context, |ui| {
            figures(ui, viewer, rate);
            ui.separator();
            display(ui, viewer, &mut commands);
            lights(ui, viewer, &mut commands);
            ui.separator();
            buttons(ui, &mut commands);
        });
    }
    if let Some(probe) = viewer.explained().probe() {
        probe_panel::lay_out(context, probe, frame());
    }
    if viewer.open().help {
        help(context, viewer, printed);
    }
    if let Some(text) = viewer.message() {
        let message = Window::new("message").title_bar(false).resizable(false).frame(frame()).interactable(false);
        message.anchor(Align2::CENTER_BOTTOM, [0.0, -4.0 * MARGIN]).show(context, |ui| ui.label(text));
    }
    commands
}

/// Dark and a little transparent: the picture matters more.
fn frame() -> Frame {
    Frame::new().fill(Color32::from_black_alpha(200)).inner_margin(MARGIN).corner_radius(4.0)
}

/// Nearly opaque: what is long must be read well.
fn page() -> Frame {
    frame().fill(Color32::from_black_alpha(240))
}

fn figures(ui: &mut Ui, viewer: &Viewer, rate: Rate) {
    let EngineStats { rays, vertices, estimated_error, converged, .. } = *viewer.stats();
    let size = viewer.session().size();
    Grid::new("figures").num_columns(2).show(ui, |ui| {
        let mut row = |name: &str, value: String| {
            ui.label(RichText::new(name).weak());
            ui.monospace(value);
            ui.end_row();
        };
        row("frames", format!("{:.1} fps  {:.1} ms  {size}", rate.pictures, rate.frame_ms));
        row("rays", format!("{}  {}/s", short(rays as f64), short(rate.rays)));
        row("vertices", short(vertices as f64));
        let error = estimated_error.map_or_else(|| "-".to_owned(), |error| format!("{:.2} %", error * 100.0));
        row("error", format!("{error}{}", if converged { "  done" } else { "" }));
        if viewer.is_recording() {
            row("recording", format!("{:.1} s", viewer.time()));
        }
    });
}

/// A number in thousands and the like.
fn short(value: f64) -> String {
    let (scale, suffix) = match value {
        v if v >= 1e9 => (1e9, " G"),
        v if v >= 1e6 => (1e6, " M"),
        v if v >= 1e4 => (1e3, " k"),
        _ => return format!("{value:.0}"),
    };
    format!("{:.2}{suffix}", value / scale)
}

fn display(ui: &mut Ui, viewer: &Viewer, commands: &mut Vec<Command>) {
    let mut shown = viewer.session().display();
    let slider = Slider::new(&mut shown.exposure, STOPS).text("exposure").suffix(" stops").step_by(0.1);
    if ui.add(slider.clamping(egui::SliderClamping::Never)).changed() {
        commands.push(Command::Exposure(shown.exposure));
    }
    let before = shown.tone_mapping;
    let choice = egui::ComboBox::from_label("tone mapping").selected_text(operator_name(before));
    choice.show_ui(ui, |ui| {
        for (name, operator) in ToneMapping::NAMES {
            ui.selectable_value(&mut shown.tone_mapping, operator, name);
        }
    });
    if shown.tone_mapping != before {
        commands.push(Command::ToneMapping(shown.tone_mapping));
    }
}

fn lights(ui: &mut Ui, viewer: &Viewer, commands: &mut Vec<Command>) {
    let lights = viewer.lights().all();
    let header = egui::CollapsingHeader::new(format!("lights ({})", lights.len())).open(Some(viewer.open().lights));
    let list = header.show(ui, |ui| {
        ScrollArea::vertical().max_height(LIST).show(ui, |ui| {
            Grid::new("lights").num_columns(2).show(ui, |ui| {
                for light in lights {
                    let (mut on, mut power) = (light.on, light.power);
                    if ui.checkbox(&mut on, &light.name).changed() {
                        commands.push(Command::ToggleLight(light.name.clone()));
                    }
                    let slider = Slider::new(&mut power, POWER).clamping(egui::SliderClamping::Never);
                    if ui.add(slider.prefix("× ")).changed() {
                        commands.push(Command::DimLight(light.name.clone(), power.max(0.0)));
                    }
                    ui.end_row();
                }
            });
        });
    });
    if list.header_response.clicked() {
        commands.push(Command::ToggleLights);
    }
}

fn buttons(ui: &mut Ui, commands: &mut Vec<Command>) {
    ui.horizontal(|ui| {
        for (label, command) in
            [("frame all", Command::FrameAll), ("screenshot", Command::Screenshot(None)), ("help", Command::ToggleHelp)]
        {
            let help = Entry::named(command.words().0).map_or("", |entry| entry.help);
            if ui.button(label).on_hover_text(help).clicked() {
                commands.push(command);
            }
        }
    });
}

fn help(context: &Context, viewer: &Viewer, printed: &dyn Fn(KeyCode) -> Option<String>) {
    let most = context.content_rect().size() - egui::Vec2::splat(6.0 * MARGIN);
    let panel = Window::new("help").title_bar(false).frame(page()).fixed_size(most.min(HELP));
    panel.anchor(Align2::CENTER_CENTER, [0.0, 0.0]).show(context, |ui| {
        ScrollArea::both().auto_shrink(false).show(ui, |ui| {
            ui.label("Shift flies three times as fast, Ctrl at a third");
            Grid::new("keys").num_columns(3).striped(true).show(ui, |ui| {
                for entry in ENTRIES.iter().filter(|entry| !entry.triggers.is_empty()) {
                    ui.monospace(labels(entry.triggers, printed));
                    ui.label(entry.help);
                    ui.monospace(state(entry.name, viewer).unwrap_or_default());
                    ui.end_row();
                }
            });
            ui.separator();
            ui.label("In scripts, these too:");
            for entry in ENTRIES.iter().filter(|entry| entry.triggers.is_empty()) {
                ui.label(RichText::new(entry.usage()).monospace()).on_hover_text(entry.help);
            }
        });
    });
}

/// What a command has set at present.
fn state(name: &str, viewer: &Viewer) -> Option<String> {
    let switch = |on: bool| if on { "on" } else { "off" }.to_owned();
    match name {
        "hud.toggle" => Some(switch(viewer.open().hud)),
        "hud.lights" => Some(switch(viewer.open().hud && viewer.open().lights)),
        "help.toggle" => Some(switch(viewer.open().help)),
        "tone-mapping.next" => Some(operator_name(viewer.session().display().tone_mapping).to_owned()),
        "exposure.add" => Some(format!("{:+.1}", viewer.session().display().exposure)),
        "camera.speed" => Some(format!("{:.3}/s", viewer.flight().speed)),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short() {
        let all = [0.0, 950.4, 9999.0, 12_345.0, 3_450_000.0, 7.2e9].map(short);
        assert_eq!(all, ["0", "950", "9999", "12.35 k", "3.45 M", "7.20 G"]);
    }
}
