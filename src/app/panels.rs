//! The panel with figures and settings, messages, and the help. What is clicked comes out as commands.

mod display;
mod error_graph;
mod figures;
mod help;
mod light_markers;
mod lights;
mod style;

use super::command::Command;
use super::probe_panel;
use super::rate::Rate;
use super::table::Entry;
use super::viewer::Viewer;
use egui::{Align2, Context, Ui, Window};
use style::{MARGIN, frame, page};
use winit::keyboard::KeyCode;

/// Width of the panel, points.
const WIDTH: f32 = 230.0;

/// Lays the panels out; what was clicked. `printed` tells what is printed on a key.
pub fn lay_out(
    context: &Context,
    viewer: &Viewer,
    rate: Rate,
    printed: &dyn Fn(KeyCode) -> Option<String>,
) -> Vec<Command> {
    let mut commands = Vec::new();
    if viewer.open().hud && viewer.open().lights {
        light_markers::lay_out(context, viewer, &mut commands);
    }
    if viewer.open().hud {
        let panel = Window::new("penombre").title_bar(false).resizable(false).default_width(WIDTH).frame(frame());
        panel.anchor(Align2::LEFT_TOP, [MARGIN, MARGIN]).show(context, |ui| {
            figures::lay_out(ui, viewer, rate);
            error_graph::lay_out(ui, viewer.errors().points());
            ui.separator();
            display::lay_out(ui, viewer, &mut commands);
            lights::lay_out(ui, viewer, &mut commands);
            ui.separator();
            buttons(ui, &mut commands);
        });
    }
    if let Some(probe) = viewer.explained().probe() {
        probe_panel::lay_out(context, probe, page());
    }
    if viewer.open().help {
        help::lay_out(context, viewer, printed);
    }
    if let Some(text) = viewer.message() {
        let message = Window::new("message").title_bar(false).resizable(false).frame(frame()).interactable(false);
        message.anchor(Align2::CENTER_BOTTOM, [0.0, -4.0 * MARGIN]).show(context, |ui| ui.label(text));
    }
    commands
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
