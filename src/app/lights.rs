//! What the user makes of the scene's lights: switches, factors and places.

use crate::scene::light::{Light, LightState};
use glam::Vec3;

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
    pub position: Option<Vec3>,
}

/// The lights of a scene, in its order.
#[derive(Clone, Debug, PartialEq)]
pub struct Lights(Vec<Setting>);

impl Lights {
    /// All as loaded.
    #[must_use]
    pub fn new(lights: &[Light]) -> Self {
        let as_loaded = |Light { name, .. }: &Light| {
            let name = name.clone();
            Setting { name, on: true, power: 1.0, colour: Vec3::ONE, position: None }
        };
        Self(lights.iter().map(as_loaded).collect())
    }

    /// As these are set, for the lights of another scene: those of the same name; others are as loaded.
    #[must_use]
    pub fn carried_to(&self, lights: &[Light]) -> Self {
        let mut carried = Self::new(lights);
        for set in &self.0 {
            carried.change(&set.name, |light| light.clone_from(set));
        }
        carried
    }

    /// Every light.
    #[must_use]
    pub fn all(&self) -> &[Setting] {
        &self.0
    }

    /// Changes every light of a name; whether there is one.
    pub fn change(&mut self, name: &str, change: impl Fn(&mut Setting)) -> bool {
        let mut named = self.0.iter_mut().filter(|light| light.name == name).peekable();
        let there_is = named.peek().is_some();
        named.for_each(change);
        there_is
    }

    /// Each as it is set.
    #[must_use]
    pub fn states(&self) -> Vec<LightState> {
        let factor = |light: &Setting| light.colour * if light.on { light.power } else { 0.0 };
        self.0.iter().map(|light| LightState { factor: factor(light), position: light.position }).collect()
    }
}
