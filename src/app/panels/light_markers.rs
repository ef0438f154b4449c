//! Where point and spot lights are, marked in the picture; dragging a mark moves its light, as far ahead as it is.

use crate::app::command::Command;
use crate::app::lights::Setting;
use crate::app::pick::moved_across;
use crate::app::viewer::Viewer;
use crate::scene::camera::View;
use egui::{
    Align2, Area, Color32, Context, CursorIcon, FontId, Id, Pos2, Rect, Response, Sense, Stroke, Ui, Vec2, WidgetInfo,
    WidgetType,
};
use glam::Vec3;

/// Radius of a mark, and of what can be grasped of it, points.
const RADIUS: f32 = 6.0;
const REACH: f32 = 9.0;
/// Colours of lights that are on and off, and of what makes them stand out from any picture.
const ON: Color32 = Color32::from_rgb(255, 220, 110);
const OFF: Color32 = Color32::from_gray(90);
const RIM: Stroke = Stroke { width: 1.5, color: Color32::from_black_alpha(200) };
const NAME: f32 = 12.0;

/// Lays them out; which were dragged.
pub(super) fn lay_out(context: &Context, viewer: &Viewer, commands: &mut Vec<Command>) {
    let Some(view) = viewer.session().view() else { return };
    let (screen, origin) = (context.content_rect(), viewer.session().scene().origin);
    for light in viewer.lights().all() {
        let Some(place) = light.position() else { continue };
        let Some(at) = shown_at(view, place, screen) else { continue };
        let dragged = mark(context, light, at).drag_delta();
        if dragged != Vec2::ZERO {
            let pixels = dragged / screen.size() * egui::vec2(view.size.width as f32, view.size.height as f32);
            let to = moved_across(view, place, glam::Vec2::new(pixels.x, pixels.y));
            commands.push(Command::MoveLight(light.name.clone(), to.as_dvec3() + origin));
        }
    }
}

/// Where the picture, which fills the screen, shows a point; `None` if it does not.
fn shown_at(view: &View, point: Vec3, screen: Rect) -> Option<Pos2> {
    let pixel = view.pixel_of(point)?;
    let share = egui::vec2(pixel.x / view.size.width as f32, pixel.y / view.size.height as f32);
    let at = screen.min + share * screen.size();
    screen.contains(at).then_some(at)
}

fn mark(context: &Context, light: &Setting, at: Pos2) -> Response {
    let area = Area::new(Id::new(("light", &light.name))).fixed_pos(at - Vec2::splat(REACH)).constrain(false);
    let response = area.show(context, |ui| paint(ui, light)).inner;
    response.widget_info(|| WidgetInfo::labeled(WidgetType::Button, true, format!("move {}", light.name)));
    response.on_hover_cursor(CursorIcon::Grab)
}

fn paint(ui: &mut Ui, light: &Setting) -> Response {
    let (rect, response) = ui.allocate_exact_size(Vec2::splat(2.0 * REACH), Sense::drag());
    // The name reaches beyond what can be grasped.
    let painter = ui.painter().with_clip_rect(ui.ctx().content_rect());
    let fill = if light.on { ON } else { OFF };
    painter.circle(rect.center(), RADIUS, fill, RIM);
    let beside = rect.right_center();
    for (offset, colour) in [(Vec2::splat(1.0), RIM.color), (Vec2::ZERO, Color32::WHITE)] {
        painter.text(beside + offset, Align2::LEFT_CENTER, &light.name, FontId::proportional(NAME), colour);
    }
    response
}
