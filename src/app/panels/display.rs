//! How the picture is displayed, the debug view, and how changes are redrawn.

use crate::app::command::{Command, operator_name};
use crate::app::viewer::Viewer;
use crate::app::views::VIEWS;
use crate::pass::UpdateMode;
use crate::scene::ToneMapping;
use egui::{ComboBox, Slider, Ui};

/// Range of the exposure's slider, stops.
const STOPS: std::ops::RangeInclusive<f32> = -10.0..=10.0;

/// Lays them out; what was clicked.
pub(super) fn lay_out(ui: &mut Ui, viewer: &Viewer, commands: &mut Vec<Command>) {
    tone_mapping(ui, viewer, commands);
    view(ui, viewer, commands);
    update_mode(ui, viewer, commands);
}

fn tone_mapping(ui: &mut Ui, viewer: &Viewer, commands: &mut Vec<Command>) {
    let mut shown = viewer.session().display();
    let slider = Slider::new(&mut shown.exposure, STOPS).text("exposure").suffix(" stops").step_by(0.1);
    if ui.add(slider.clamping(egui::SliderClamping::Never)).changed() {
        commands.push(Command::Exposure(shown.exposure));
    }
    let before = shown.tone_mapping;
    let choice = ComboBox::from_label("tone mapping").selected_text(operator_name(before));
    choice.show_ui(ui, |ui| {
        for (name, operator) in ToneMapping::NAMES {
            ui.selectable_value(&mut shown.tone_mapping, operator, name);
        }
    });
    if shown.tone_mapping != before {
        commands.push(Command::ToneMapping(shown.tone_mapping));
    }
}

fn view(ui: &mut Ui, viewer: &Viewer, commands: &mut Vec<Command>) {
    let (chosen, lights) = (viewer.view(), &viewer.session().scene().lights);
    ComboBox::from_label("view").selected_text(chosen.view.name).height(400.0).show_ui(ui, |ui| {
        for view in VIEWS.iter().filter(|view| !view.of_light || !lights.is_empty()) {
            if ui.selectable_label(*view == *chosen.view, view.name).on_hover_text(view.help).clicked() {
                commands.push(Command::View(view, None));
            }
        }
    });
    let Some(light) = lights.get(chosen.light as usize).filter(|_| chosen.view.of_light) else { return };
    ComboBox::from_label("of light").selected_text(&light.name).show_ui(ui, |ui| {
        for other in lights {
            if ui.selectable_label(other.name == light.name, &other.name).clicked() {
                commands.push(Command::View(chosen.view, Some(other.name.clone())));
            }
        }
    });
}

fn update_mode(ui: &mut Ui, viewer: &Viewer, commands: &mut Vec<Command>) {
    let session = viewer.session();
    let mode = session.update_mode();
    ComboBox::from_label("update mode").selected_text(mode.name()).height(300.0).show_ui(ui, |ui| {
        for other in UpdateMode::ALL.into_iter().filter(|mode| session.renderer().allows(*mode)) {
            if ui.selectable_label(other == mode, other.name()).clicked() {
                commands.push(Command::Update(other));
            }
        }
    });
}
