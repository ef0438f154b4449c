//! The help: commands with their keys, and what is set at present.

use super::style::{MARGIN, page};
use crate::app::command::operator_name;
use crate::app::table::ENTRIES;
use crate::app::trigger::labels;
use crate::app::viewer::Viewer;
use egui::{Align2, Context, Grid, Label, RichText, ScrollArea, Ui, Window};
use winit::keyboard::KeyCode;

/// Its size where the window is large enough, points.
const HELP: egui::Vec2 = egui::vec2(980.0, 640.0);

/// Shares of the columns in the width: keys, help and state.
const COLUMNS: [f32; 3] = [0.3, 0.52, 0.18];
/// What lies between columns and beside them, points.
const SPACE: f32 = 40.0;

/// Lays it out.
pub(super) fn lay_out(context: &Context, viewer: &Viewer, printed: &dyn Fn(KeyCode) -> Option<String>) {
    let most = context.content_rect().size() - egui::Vec2::splat(6.0 * MARGIN);
    let panel = Window::new("help").title_bar(false).frame(page()).fixed_size(most.min(HELP));
    panel.anchor(Align2::CENTER_CENTER, [0.0, 0.0]).show(context, |ui| {
        ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
            ui.label("Shift flies three times as fast, Ctrl at a third");
            let widths = COLUMNS.map(|share| share * (ui.available_width() - SPACE));
            Grid::new("keys").num_columns(3).striped(true).show(ui, |ui| {
                for entry in ENTRIES.iter().filter(|entry| !entry.triggers.is_empty()) {
                    cell(ui, widths[0], RichText::new(labels(entry.triggers, printed)).monospace());
                    cell(ui, widths[1], RichText::new(entry.help));
                    cell(ui, widths[2], RichText::new(state(entry.name, viewer).unwrap_or_default()).monospace());
                    ui.end_row();
                }
            });
            ui.separator();
            ui.label("In scripts, these too:");
            for entry in ENTRIES.iter().filter(|entry| entry.triggers.is_empty()) {
                ui.add(Label::new(RichText::new(entry.usage()).monospace()).wrap()).on_hover_text(entry.help);
            }
        });
    });
}

/// Text in lines as wide as its column.
fn cell(ui: &mut Ui, width: f32, text: RichText) {
    ui.scope(|ui| {
        ui.set_width(width);
        ui.add(Label::new(text).wrap());
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
        "reference.show" => Some(switch(viewer.shows_reference())),
        "view.next" => Some(viewer.view().label(viewer.session().scene())),
        "exposure.add" => Some(format!("{:+.1}", viewer.session().display().exposure)),
        "camera.speed" => Some(format!("{:.3}/s", viewer.flight().speed)),
        _ => None,
    }
}
