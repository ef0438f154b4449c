//! The debug views by name, and the one that is chosen.

use crate::scene::Scene;
use crate::session::DebugView;

/// A debug view of the table. Those that are layers of written images have their names.
#[derive(Debug)]
pub struct View {
    /// Its name.
    pub name: &'static str,
    /// What it shows, in a line.
    pub help: &'static str,
    /// Whether it is one of a light.
    pub of_light: bool,
    /// The view, of the light of a number.
    view: fn(u32) -> DebugView,
}

/// All views, in the order in which they follow each other.
pub const VIEWS: &[View] = &[
    View { name: "final", help: "The picture", of_light: false, view: |_| DebugView::Final },
    View { name: "kd", help: "Diffuse reflectance", of_light: false, view: |_| DebugView::Kd },
    View { name: "ks", help: "Specular reflectance", of_light: false, view: |_| DebugView::Ks },
    View { name: "Le", help: "Emitted radiance", of_light: false, view: |_| DebugView::Emission },
    View { name: "D", help: "Diffuse luminance", of_light: false, view: |_| DebugView::Diffuse },
    View { name: "S", help: "Specular luminance", of_light: false, view: |_| DebugView::Specular },
    View { name: "direct", help: "D of one light's direct light", of_light: true, view: DebugView::Direct },
    View { name: "indirect", help: "D of indirect light", of_light: false, view: |_| DebugView::Indirect },
    View { name: "face.id", help: "A colour for each face", of_light: false, view: |_| DebugView::Faces },
    View {
        name: "level",
        help: "Splits above drawn triangles: none grey, few blue, ten red",
        of_light: false,
        view: |_| DebugView::Level,
    },
    View {
        name: "error",
        help: "Estimated error against the image's mean: 0.1 % blue, 1 % green, 10 % yellow, more red",
        of_light: false,
        view: |_| DebugView::Error,
    },
    View {
        name: "stale",
        help: "Vertices without a value red, guessed yellow, covered by geometry blue",
        of_light: false,
        view: |_| DebugView::Knowledge,
    },
    View { name: "mesh", help: "The drawn triangles", of_light: false, view: |_| DebugView::Mesh },
    View {
        name: "light-mesh",
        help: "The mesh at whose vertices one light was sampled",
        of_light: true,
        view: DebugView::LightMesh,
    },
    View {
        name: "beside",
        help: "The picture to the left, the path-traced reference to the right",
        of_light: false,
        view: |_| DebugView::Beside,
    },
];

impl PartialEq for View {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

impl View {
    /// The view of a name.
    ///
    /// # Errors
    /// Which there are.
    pub fn named(name: &str) -> Result<&'static Self, String> {
        VIEWS.iter().find(|view| view.name == name).ok_or_else(|| {
            let names: Vec<&str> = VIEWS.iter().map(|view| view.name).collect();
            format!("{name}: expected one of {}", names.join(", "))
        })
    }
}

/// The view that is chosen, and the light of those that are of one.
#[derive(Clone, Copy, Debug)]
pub struct Choice {
    /// The view.
    pub view: &'static View,
    /// Number of the light.
    pub light: u32,
}

impl Default for Choice {
    fn default() -> Self {
        Self { view: &VIEWS[0], light: 0 }
    }
}

impl Choice {
    /// The view after it; those of a light only where there are any.
    #[must_use]
    pub fn next(self, scene: &Scene) -> Self {
        let present = VIEWS.iter().position(|view| view.name == self.view.name).unwrap_or_default();
        let following = VIEWS.iter().cycle().skip(present + 1);
        let view = following.take(VIEWS.len()).find(|view| !view.of_light || !scene.lights.is_empty());
        Self { view: view.unwrap_or(self.view), ..self }
    }

    /// What the session is to show.
    #[must_use]
    pub fn debug_view(self) -> DebugView {
        (self.view.view)(self.light)
    }

    /// Its name, with the light's if it is of one.
    #[must_use]
    pub fn label(self, scene: &Scene) -> String {
        let light = scene.lights.get(self.light as usize).filter(|_| self.view.of_light);
        light.map_or_else(|| self.view.name.to_owned(), |light| format!("{} {}", self.view.name, light.name))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn views_follow_each_other_in_a_circle() {
        let dark = Scene::default();
        let mut choice = Choice::default();
        let mut seen = Vec::new();
        while seen.last() != Some(&"final") {
            choice = choice.next(&dark);
            seen.push(choice.view.name);
        }
        let of_no_light = VIEWS.iter().filter(|view| !view.of_light).count();
        assert_eq!((seen.len(), seen[0]), (of_no_light, "kd"));
        assert!(View::named("albedo").unwrap_err().contains("final, kd, ks"));
    }
}
