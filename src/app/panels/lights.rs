//! The list of lights.

use crate::app::command::Command;
use crate::app::viewer::Viewer;
use egui::{Grid, ScrollArea, Slider, Ui};

/// Range of a light's slider, a factor on its power in the scene.
const POWER: std::ops::RangeInclusive<f32> = 0.0..=4.0;
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
                }
            });
        });
    });
    if list.header_response.clicked() {
        commands.push(Command::ToggleLights);
    }
}
