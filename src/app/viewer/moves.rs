//! How commands move the camera.

use super::Viewer;
use crate::app::command::Command;
use crate::app::pick;
use crate::scene::camera::Camera;
use glam::{Vec2, Vec3};

/// Seconds for which the speed is shown.
const SPEED: f64 = 2.0;

impl Viewer {
    pub(super) fn move_camera(&mut self, command: &Command) {
        let flight = &mut self.flight;
        match command {
            Command::Fly(velocity) => flight.velocity = *velocity,
            Command::Speed(factor) => return self.change_speed(*factor),
            Command::Look(angles) => flight.look(*angles),
            Command::Pivot(place) => return self.choose_pivot(*place),
            Command::Orbit(angles) => flight.orbit(*angles),
            Command::Pan(shift) => flight.pan(*shift),
            Command::Dolly(factor) => flight.dolly(*factor),
            Command::Centre(place) => {
                if let Some(point) = self.point_at(*place) {
                    self.flight.look_at(point);
                }
            }
            Command::FrameAll => self.frame_all(),
            Command::Go(name) => return self.go(name),
            Command::Place { position, look_at } => {
                let origin = self.session.scene().origin;
                let [position, look_at] = [position, look_at].map(|point| (*point - origin).as_vec3());
                flight.camera = Camera { position, look_at, ..flight.camera };
            }
            _ => return,
        }
        self.flown = true;
        self.changed = true;
    }

    fn change_speed(&mut self, factor: f32) {
        self.flight.speed *= factor;
        let text = format!("speed {:.3} units a second", self.flight.speed);
        self.message = Some((text, self.time + SPEED));
    }

    fn point_at(&self, place: Vec2) -> Option<Vec3> {
        let renderer = self.session.renderer();
        let view = self.session.view()?;
        pick::point_at(self.session.scene(), view, renderer.face_ids(), place)
    }

    /// What is seen at a place; where nothing is, a point there as far as the one looked at.
    fn choose_pivot(&mut self, place: Vec2) {
        let reach = self.flight.reach();
        let ahead = || self.session.view().map(|view| pick::point_towards(view, place, reach));
        self.flight.pivot = self.point_at(place).or_else(ahead);
    }

    fn frame_all(&mut self) {
        let size = self.session.size();
        if let Some(bounds) = self.session.scene().bounds() {
            self.flight.frame(bounds, size.width as f32 / size.height as f32);
        }
    }

    /// Takes a camera by name or number from 1, or 0 for the one that was flown last.
    fn go(&mut self, name: &str) {
        let cameras = &self.session.scene().cameras;
        let by_name = cameras.iter().position(|camera| camera.name == name);
        let number = by_name.map(|index| index + 1).or_else(|| name.parse().ok());
        let taken = match number {
            Some(0) => self.user,
            Some(number) => cameras.get(number - 1).map(|camera| camera.camera),
            None => None,
        };
        let Some(taken) = taken else { return };
        if self.flown {
            self.user = Some(self.flight.camera);
        }
        self.flight.camera = taken;
        self.flown = number == Some(0);
        self.changed = true;
    }
}
