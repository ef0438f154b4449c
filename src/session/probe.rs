//! Why a pixel is so: what the engine knows of its light, with the colours and the image that the renderer has of it.

use super::Session;
use crate::error::{Error, Result};
use crate::pass::{FrameOptions, Layers};
use crate::refine::explanation::{Explanation, Light, NamedLight, as_array};
use crate::refine::probe::PixelQuestion;
use crate::scene::FaceId;
use crate::scene::camera::View;
use glam::Vec3;
use serde::Serialize;

/// A pixel, explained.
#[derive(Clone, Debug, Serialize)]
pub struct Probe {
    /// Its column and row, from the top left.
    pub pixel: [u32; 2],
    /// Size of the image, pixels.
    pub size: [u32; 2],
    /// The point of the scene's files that positions are relative to.
    pub origin: [f64; 3],
    /// Whether it shows a surface; else the background, and nothing else is said of it.
    pub covered: bool,
    /// What is worth knowing of it beyond figures.
    pub notes: Vec<String>,
    /// The surface and its light; none for the background.
    pub surface: Option<Explanation>,
    /// What the surface makes of light.
    pub colours: Colours,
    /// Radiance in parts, by the vertices of the surface.
    pub radiance: Radiance,
    /// The same pixel as it is drawn.
    pub image: Drawn,
}

/// Colours of a pixel, textures included.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Colours {
    /// Diffuse reflectance k_d.
    #[serde(serialize_with = "as_array")]
    pub kd: Vec3,
    /// Specular reflectance k_s.
    #[serde(serialize_with = "as_array")]
    pub ks: Vec3,
    /// Emitted radiance L_e, W·sr⁻¹·m⁻².
    #[serde(serialize_with = "as_array")]
    pub emission: Vec3,
}

/// Radiance of a pixel in parts, L = L_e + k_d D + k_s S, W·sr⁻¹·m⁻².
#[derive(Clone, Debug, Default, Serialize)]
pub struct Radiance {
    /// L_e.
    #[serde(serialize_with = "as_array")]
    pub emission: Vec3,
    /// By light group.
    pub lights: Vec<Part>,
    /// Of indirect light.
    #[serde(serialize_with = "as_array")]
    pub indirect: Vec3,
    /// Of what vertices show beyond their parts.
    #[serde(serialize_with = "as_array")]
    pub unaccounted: Vec3,
    /// All of it.
    #[serde(serialize_with = "as_array")]
    pub sum: Vec3,
}

/// Radiance of a light group.
#[derive(Clone, Debug, Serialize)]
pub struct Part {
    /// Names of its lights.
    pub lights: Vec<String>,
    /// What it adds, W·sr⁻¹·m⁻².
    #[serde(serialize_with = "as_array")]
    pub radiance: Vec3,
}

/// A pixel as it is drawn, to the precision of the images.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Drawn {
    /// Number of the triangle that is drawn there.
    pub triangle: Option<u32>,
    /// D and S.
    #[serde(flatten)]
    pub light: Light,
    /// Radiance after combining, W·sr⁻¹·m⁻², before exposure and tone mapping.
    #[serde(serialize_with = "as_array")]
    pub radiance: Vec3,
}

impl Session {
    /// Explains a pixel, by column and row from the top left, of the view that is looked at: shows all that waits to be shown, and tells
    /// of that very state.
    ///
    /// # Errors
    /// [`Error::Usage`] before there was a view, or outside of it; [`Error::Exhausted`] when the device is lost or memory runs out;
    /// [`Error::Internal`] if the engine has stopped.
    pub fn probe(&mut self, [x, y]: [u32; 2]) -> Result<Probe> {
        let view = *self.view().ok_or_else(|| Error::Usage("there is no view to explain a pixel of".to_owned()))?;
        let (width, height) = (view.size.width, view.size.height);
        if x >= width || y >= height {
            let last = [width - 1, height - 1];
            return Err(Error::Usage(format!(
                "pixel {x} {y} lies outside of the image: columns are 0 to {}, rows 0 to {}",
                last[0], last[1]
            )));
        }
        let index = y as usize * width as usize + x as usize;
        let face = self.renderer.face_ids().get(index).and_then(|id| id.checked_sub(1));
        let surface = face.map_or(Ok(None), |face| self.explain(FaceId(face), &view, index))?;
        let layers = self.renderer.read_layers()?;
        let mut probe = Probe {
            pixel: [x, y],
            size: [width, height],
            origin: self.scene.origin.to_array(),
            covered: face.is_some(),
            notes: Vec::new(),
            colours: Colours::of(&layers, index),
            radiance: Radiance::default(),
            surface,
            image: Drawn::of(&layers, index),
        };
        probe.radiance = Radiance::of(&probe);
        probe.notes = notes(&probe);
        Ok(probe)
    }

    /// What the engine knows of a pixel; the images show the same afterwards.
    fn explain(&mut self, face: FaceId, view: &View, index: usize) -> Result<Option<Explanation>> {
        let ray = view.direction(view.size.centre_of(index));
        let (updates, surface) = self.engine.explain(PixelQuestion { face, eye: view.eye, ray })?;
        let moved = self.apply(&updates)?;
        self.renderer.frame(&FrameOptions {
            colour: moved,
            full_luminance: true,
            combine: Some(self.display),
            update_mode: self.options.update,
            queries: 0,
        })?;
        Ok(surface)
    }
}

impl Colours {
    fn of(layers: &Layers, index: usize) -> Self {
        let [kd, ks, emission] = [&layers.kd, &layers.ks, &layers.le].map(|layer| Vec3::from_array(layer[index]));
        Self { kd, ks, emission }
    }

    /// What the surface makes of light.
    fn reflect(&self, light: Light) -> Vec3 {
        self.kd * light.diffuse + self.ks * light.specular
    }
}

impl Drawn {
    fn of(layers: &Layers, index: usize) -> Self {
        let [r, g, b, _] = layers.combined[index];
        let [diffuse, specular] = [layers.d[index], layers.s[index]].map(Vec3::from_array);
        Self {
            triangle: layers.drawn_id[index].checked_sub(1),
            light: Light { diffuse, specular },
            radiance: Vec3::new(r, g, b),
        }
    }
}

impl Radiance {
    fn of(Probe { colours, surface, .. }: &Probe) -> Self {
        let emission = colours.emission;
        let Some(light) = surface.as_ref().map(|surface| &surface.light) else {
            return Self { emission, sum: emission, ..Self::default() };
        };
        let part = |named: &NamedLight| Part { lights: named.lights.clone(), radiance: colours.reflect(named.light) };
        Self {
            emission,
            lights: light.lights.iter().map(part).collect(),
            indirect: colours.reflect(light.indirect),
            unaccounted: colours.reflect(light.unaccounted),
            sum: emission + colours.reflect(light.sum),
        }
    }
}

/// What is worth knowing of a pixel.
fn notes(Probe { surface, image, covered, .. }: &Probe) -> Vec<String> {
    let explained = surface.as_ref().and_then(|surface| surface.triangle.as_ref()).map(|triangle| triangle.id);
    let covered_vertices = surface.iter().flat_map(|surface| &surface.vertices).filter(|v| v.covered && v.share > 0.0);
    let cases = [
        (!covered, "the pixel shows the background"),
        (*covered && surface.is_none(), "the light of the face is not known yet"),
        (
            *covered && image.triangle.is_none(),
            "no drawn triangle covers the centre of the pixel: pixels around stand in, and parts may differ from the image",
        ),
        (
            image.triangle.is_some() && image.triangle != explained,
            "the centre of the pixel lies at the edge of two triangles, and the other one is drawn: parts may differ from the image",
        ),
        (
            covered_vertices.count() > 0,
            "a vertex is covered by other geometry, and counts for next to nothing beside others",
        ),
    ];
    cases.into_iter().filter(|case| case.0).map(|case| case.1.to_owned()).collect()
}

impl Probe {
    /// As JSON, with a line end.
    ///
    /// # Errors
    /// [`Error::Internal`] if it cannot be written as JSON.
    pub fn json(&self) -> Result<String> {
        let text = serde_json::to_string_pretty(self).map_err(|e| Error::Internal(format!("a probe as JSON: {e}")))?;
        Ok(inline_numbers(&text) + "\n")
    }
}

/// Brings the arrays of a JSON text that hold no other arrays or objects to one line each.
fn inline_numbers(pretty: &str) -> String {
    let lines: Vec<&str> = pretty.lines().collect();
    let (mut text, mut at) = (Vec::with_capacity(lines.len()), 0);
    while at < lines.len() {
        let is_element = |line: &&&str| !line.ends_with(['[', '{']) && !line.trim_start().starts_with([']', '}']);
        let inner = lines[at + 1..].iter().take_while(is_element).count();
        let end = lines.get(at + 1 + inner).map(|line| line.trim()).filter(|line| line.starts_with(']'));
        match end.filter(|_| lines[at].ends_with('[')) {
            Some(end) => {
                let elements: Vec<&str> = lines[at + 1..=at + inner].iter().map(|line| line.trim()).collect();
                text.push(lines[at].to_owned() + &elements.join(" ") + end);
                at += inner + 2;
            }
            None => {
                text.push(lines[at].to_owned());
                at += 1;
            }
        }
    }
    text.join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arrays_of_numbers_are_a_line_each() {
        let value =
            serde_json::json!({"a": [1, 2.5], "b": [[1, 2], [3, 4]], "c": [], "d": [{"e": ["x[", "y"]}], "f": {}});
        let text = inline_numbers(&serde_json::to_string_pretty(&value).unwrap());
        let expected = "{\n  \"a\": [1, 2.5],\n  \"b\": [\n    [1, 2],\n    [3, 4]\n  ],\n  \"c\": [],\n  \"d\": [\n    {\n      \
                        \"e\": [\"x[\", \"y\"]\n    }\n  ],\n  \"f\": {}\n}";
        assert_eq!(text, expected);
        assert_eq!(serde_json::from_str::<serde_json::Value>(&text).unwrap(), value);
    }
}
