//! A script played without a window: frames at fixed times, each with fixed work, as fast as they come.

use super::Plan;
use super::panels;
use super::rate::Rate;
use super::recovery::{Open, recover};
use super::screen::Screen;
use super::shots::Shot;
use super::viewer::Viewer;
use crate::error::Result;
use crate::session::Session;
use crate::vk::{Device, DeviceOptions};
use egui::{Context, Pos2, RawInput, Rect};
use std::path::PathBuf;

/// How often panels are laid out for a frame, at most: those that are new are only measured at first.
const LAYOUTS: u32 = 3;

/// Frames of a script.
pub struct Film {
    /// Frames a second of the script's time.
    pub rate: f64,
    /// The file of a frame, from 0, if frames are written.
    pub file: Option<Box<dyn Fn(u64) -> PathBuf>>,
}

/// Plays the plan's script up to its last command, in a session of fixed work a frame; the files that were recorded.
///
/// # Errors
/// A file that cannot be written, a scene that cannot be loaded again, a lost device.
pub fn play(session: Session, mut plan: Plan, film: &Film) -> Result<Vec<PathBuf>> {
    let context = Context::default();
    // Nothing is half there in a frame.
    context.all_styles_mut(|style| style.animation_time = 0.0);
    let mut screen = Screen::new(session.renderer().device(), session.size(), None, context)?;
    let wanted = DeviceOptions { device: session.options().device.clone(), validation: None };
    let mut open: Open = Box::new(move || Ok((Device::new(&wanted)?, None)));
    let mut viewer = Viewer::new(session, plan.camera, plan.name.clone(), plan.open);
    let steps = std::mem::take(&mut plan.script.steps);
    let duration = steps.last().map_or(0.0, |step| step.time);
    let mut steps = steps.iter().peekable();
    for number in 0.. {
        let time = number as f64 / film.rate;
        while let Some(step) = steps.next_if(|step| step.time <= time) {
            viewer.advance(step.time);
            viewer.execute(&step.command)?;
            if viewer.take_reload() {
                viewer.reloaded(Ok(plan.source.load()?))?;
            }
        }
        viewer.advance(time);
        while let Err(fault) = draw(&mut viewer, &mut plan) {
            recover(fault, &mut viewer, &mut screen, &mut open)?;
        }
        while let Err(fault) = show(&mut viewer, &mut screen) {
            recover(fault, &mut viewer, &mut screen, &mut open)?;
        }
        let frame = film.file.as_ref().map(|file| Shot { path: file(number), with_panels: true });
        for shot in viewer.take_shots().iter().chain(&frame) {
            shot.write(&mut screen, viewer.session_mut())?;
        }
        if viewer.has_ended() || time >= duration || (plan.interrupted)() {
            break;
        }
    }
    plan.finish(viewer.session())?;
    viewer.finish()
}

/// A frame, and the work that belongs to it where it is the first of a new view.
fn draw(viewer: &mut Viewer, plan: &mut Plan) -> Result<()> {
    if viewer.frame(plan)?.is_some_and(|report| report.camera_moved) {
        viewer.frame(plan)?;
    }
    Ok(())
}

fn show(viewer: &mut Viewer, screen: &mut Screen) -> Result<()> {
    let size = viewer.session().size();
    let pixels = egui::vec2(size.width as f32, size.height as f32);
    let input = RawInput {
        time: Some(viewer.time()),
        screen_rect: Some(Rect::from_min_size(Pos2::ZERO, pixels)),
        ..RawInput::default()
    };
    for _ in 0..LAYOUTS {
        let asked = screen.lay_out(input.clone(), |context| {
            panels::lay_out(context, viewer, Rate::default(), &|_| None);
        });
        if !asked.again.is_zero() {
            break;
        }
    }
    screen.show(viewer.session().renderer().display_image(), size).map(drop)
}
