//! What the user makes of the scene's lights: switches, factors and places.

use super::command::Command;
use crate::scene::light::{Light, LightState};
use glam::{DVec3, Vec3};

/// A light as it is set.
#[derive(Clone, Debug, PartialEq)]
pub struct Setting {
    /// Name, as in the scene.
    pub name: String,
    /// Whether it is on.
    pub on: bool,
    /// Power, as a factor on that of the scene.
    pub power: f32,
    /// Colour, as factors on that of the scene, linear Rec.709.
    pub colour: Vec3,
    /// Where it was moved to, scene units.
    pub moved_to: Option<Vec3>,
    /// Where the scene has it, scene units, if it can be moved.
    loaded: Option<Vec3>,
}

impl Setting {
    fn as_loaded(light: &Light) -> Self {
        let (name, loaded) = (light.name.clone(), light.kind.position());
        Self { name, on: true, power: 1.0, colour: Vec3::ONE, moved_to: None, loaded }
    }

    /// Where it is, scene units, if it can be moved.
    #[must_use]
    pub fn position(&self) -> Option<Vec3> {
        self.loaded.map(|loaded| self.moved_to.unwrap_or(loaded))
    }
}

/// The lights of a scene, in its order.
#[derive(Clone, Debug, PartialEq)]
pub struct Lights(Vec<Setting>);

impl Lights {
    /// All as loaded.
    #[must_use]
    pub fn new(lights: &[Light]) -> Self {
        Self(lights.iter().map(Setting::as_loaded).collect())
    }

    /// As these are set, for the lights of another scene: those of the same name; others are as loaded. What is moved stays
    /// where it is, which is `shift` away in the other's units.
    #[must_use]
    pub fn carried_to(&self, lights: &[Light], shift: Vec3) -> Self {
        let mut carried = Self::new(lights);
        for set in &self.0 {
            let moved_to = set.moved_to.map(|place| place + shift);
            carried.change(&set.name, |light| *light = Setting { moved_to, loaded: light.loaded, ..set.clone() });
        }
        carried
    }

    /// Every light.
    #[must_use]
    pub fn all(&self) -> &[Setting] {
        &self.0
    }

    /// Changes every light of a name.
    pub fn change(&mut self, name: &str, change: impl Fn(&mut Setting)) {
        self.0.iter_mut().filter(|light| light.name == name).for_each(change);
    }

    /// Does what a command says of the lights of a name; `origin` is that of the scene.
    pub fn execute(&mut self, command: &Command, origin: DVec3) {
        match command {
            Command::ToggleLight(name) => self.change(name, |light| light.on = !light.on),
            Command::DimLight(name, power) => self.change(name, |light| light.power = *power),
            Command::ColourLight(name, factors) => self.change(name, |light| light.colour = Vec3::from_array(*factors)),
            Command::MoveLight(name, to) => self.change(name, |light| light.moved_to = Some((*to - origin).as_vec3())),
            _ => {}
        }
    }

    /// Each as it is set.
    #[must_use]
    pub fn states(&self) -> Vec<LightState> {
        let factor = |light: &Setting| light.colour * if light.on { light.power } else { 0.0 };
        self.0.iter().map(|light| LightState { factor: factor(light), position: light.moved_to }).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::light::LightKind;

    fn lamps(x: f32) -> [Light; 2] {
        let kind = LightKind::Point { position: Vec3::X * x, intensity: Vec3::ONE };
        let sun = LightKind::Directional { direction: Vec3::X, irradiance: Vec3::ONE };
        [("lamp", kind), ("sun", sun)].map(|(name, kind)| Light { name: name.to_owned(), kind })
    }

    /// Loaded again about another origin, and with the lamp elsewhere in its file.
    #[test]
    fn a_light_that_was_moved_stays_where_it_is_and_others_follow_their_file() {
        let mut lights = Lights::new(&lamps(1.0));
        assert_eq!(lights.all()[1].position(), None);
        let follows = lights.carried_to(&lamps(2.0), Vec3::Y);
        assert_eq!((follows.all()[0].position(), follows.states()[0].position), (Some(Vec3::X * 2.0), None));
        lights.execute(&Command::MoveLight("lamp".to_owned(), DVec3::new(103.0, 0.0, 0.0)), DVec3::X * 100.0);
        assert_eq!(lights.states()[0].position, Some(Vec3::X * 3.0));
        let stays = lights.carried_to(&lamps(2.0), Vec3::Y);
        assert_eq!(stays.all()[0].position(), Some(Vec3::new(3.0, 1.0, 0.0)));
    }
}
