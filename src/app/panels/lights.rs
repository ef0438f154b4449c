//! The list of lights.

use crate::app::command::Command;
use crate::app::lights::Setting;
use crate::app::viewer::Viewer;
use egui::{DragValue, Grid, ScrollArea, Slider, Ui};

/// Range of a light's slider, a factor on its power in the scene.
const POWER: std::ops::RangeInclusive<f32> = 0.0..=4.0;
/// What a point of dragging adds to a coordinate, against the scene's scale.
const DRAG: f64 = 2e-3;
/// Height of the list at most, points.
const LIST: f32 = 260.0;

/// Lays it out; what was clicked.
pub(super) fn lay_out(ui: &mut Ui, viewer: &Viewer, commands: &mut Vec<Command>) {
    let lights = viewer.lights().all();
    let header = egui::CollapsingHeader::new(format!("lights ({})", lights.len())).open(Some(viewer.open().lights));
    let list = header.show(ui, |ui| {
        ScrollArea::vertical().max_height(LIST).show(ui, |ui| {
            Grid::new("lights").num_columns(3).show(ui, |ui| {
                for light in lights {
                    let (mut on, mut power) = (light.on, light.power);
                    if ui.checkbox(&mut on, &light.name).changed() {
                        commands.push(Command::ToggleLight(light.name.clone()));
                    }
                    let mut colour = light.colour.to_array();
                    if ui.color_edit_button_rgb(&mut colour).on_hover_text("colour, as factors").changed() {
                        commands.push(Command::ColourLight(light.name.clone(), colour));
                    }
                    let slider = Slider::new(&mut power, POWER).clamping(egui::SliderClamping::Never);
                    if ui.add(slider.prefix("× ")).changed() {
                        commands.push(Command::DimLight(light.name.clone(), power.max(0.0)));
                    }
                    ui.end_row();
                    place(ui, viewer, light, commands);
                }
            });
        });
    });
    if list.header_response.clicked() {
        commands.push(Command::ToggleLights);
    }
}

/// Coordinates of a light that can be moved, in those of the scene's files.
fn place(ui: &mut Ui, viewer: &Viewer, light: &Setting, commands: &mut Vec<Command>) {
    let scene = viewer.session().scene();
    let Some(place) = light.position() else { return };
    let before = place.as_dvec3() + scene.origin;
    let mut to = before;
    ui.label("");
    ui.label("");
    ui.horizontal(|ui| {
        for (axis, value) in ["x", "y", "z"].into_iter().zip(to.as_mut()) {
            let drag = DragValue::new(value).speed(f64::from(viewer.session().scale()) * DRAG).max_decimals(3);
            ui.add(drag).on_hover_text(format!("{axis} of {}", light.name));
        }
    });
    ui.end_row();
    if to != before {
        commands.push(Command::MoveLight(light.name.clone(), to));
    }
}
