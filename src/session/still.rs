//! The images that a run leaves behind: its layers, and the mean of jittered redraws.

use super::Session;
use crate::error::{Error, Result};
use crate::image::exr::{Provenance, RenderLayers, write_render};
use crate::image::film::{Film, jitter};
use crate::image::{FileFormat, png};
use crate::pass::{FrameOptions, Layers, Renderer, UpdateMode};
use crate::refine::replay::Levels;
use crate::refine::update::DrawnId;
use crate::scene::Display;
use crate::scene::camera::{Camera, View};
use glam::{DVec3, Vec2, Vec3, Vec4};
use std::path::Path;

/// A finished image with its layers.
pub struct Still {
    /// The view.
    pub view: View,
    /// How it is displayed.
    pub display: Display,
    /// Radiance and coverage of each pixel, the mean of the redraws, W·sr⁻¹·m⁻².
    pub combined: Vec<Vec4>,
    /// Layers at pixel centres.
    pub layers: Layers,
    /// Splits above the drawn triangle of each pixel centre; 0 where nothing is drawn.
    pub level: Vec<u32>,
    /// The camera that the view comes from, if it comes from one.
    pub camera: Option<Camera>,
    /// The point of the scene's files that is the origin.
    pub origin: DVec3,
}

impl Session {
    /// Redraws the present state of the light as a finished image: the layers at pixel centres, and the combined image as the mean
    /// over [`super::Options::redraws`] jittered redraws in linear light.
    ///
    /// # Errors
    /// [`Error::Usage`] before there was a view; the device is lost or memory runs out.
    pub fn still(&mut self) -> Result<Still> {
        self.draw_light()?;
        let shot = self.shot.as_ref().ok_or_else(|| Error::Usage("there is no view to make an image of".to_owned()))?;
        let (view, camera, display) = (shot.view, shot.camera, self.display);
        let (combined, layers) = take(&mut self.renderer, &view, display, self.options.redraws)?;
        let level = levels(&self.levels, &layers.drawn_id);
        Ok(Still { view, display, combined, layers, level, camera, origin: self.scene.origin })
    }
}

/// The combined image and the layers.
fn take(renderer: &mut Renderer, view: &View, display: Display, redraws: u32) -> Result<(Vec<Vec4>, Layers)> {
    if redraws == 1 {
        let layers = renderer.read_layers()?;
        return Ok((combined(&layers), layers));
    }
    let mut film = Film::new(view.size);
    // N points of a pixel stand for a square of 1/N of its area each.
    renderer.set_filter_width((redraws as f32).sqrt().recip());
    for offset in jitter(redraws) {
        film.add(&combined(&redraw(renderer, view, display, offset)?));
    }
    renderer.set_filter_width(1.0);
    let layers = redraw(renderer, view, display, Vec2::ZERO)?;
    Ok((film.mean(), layers))
}

/// Levels of the triangles of ids − 1.
fn levels(levels: &Levels, drawn_id: &[u32]) -> Vec<u32> {
    let level = |id: &u32| id.checked_sub(1).map_or(0, |drawn| levels.of(DrawnId(drawn)));
    drawn_id.iter().map(|id| level(id).into()).collect()
}

fn redraw(renderer: &mut Renderer, view: &View, display: Display, offset: Vec2) -> Result<Layers> {
    renderer.set_view(view, offset);
    renderer.visibility()?;
    let update_mode = UpdateMode::Id;
    renderer.frame(&FrameOptions {
        colour: true,
        full_luminance: true,
        combine: Some(display),
        update_mode,
        queries: 0,
    })?;
    renderer.read_layers()
}

fn combined(layers: &Layers) -> Vec<Vec4> {
    layers.combined.iter().copied().map(Vec4::from_array).collect()
}

impl Still {
    /// Writes one file, in the format that its name asks for; a warning where values could not be held.
    ///
    /// # Errors
    /// [`Error::Io`] naming the file.
    pub fn write(&self, path: &Path, comments: &str) -> Result<Option<String>> {
        match FileFormat::of(path) {
            Some(FileFormat::Png) => png::write(path, self.view.size, &self.combined, &self.display).map(|()| None),
            Some(FileFormat::Exr) => self.write_exr(path, comments),
            None => Err(Error::Usage(format!("{}: write .exr or .png", path.display()))),
        }
    }

    fn write_exr(&self, path: &Path, comments: &str) -> Result<Option<String>> {
        let vectors = |pixels: &[[f32; 3]]| pixels.iter().copied().map(Vec3::from_array).collect::<Vec<Vec3>>();
        let Layers { kd, ks, d, s, le, face_id, .. } = &self.layers;
        let [kd, ks, diffuse, specular, emitted] = [kd, ks, d, s, le].map(|layer| vectors(layer));
        let layers = RenderLayers {
            size: self.view.size,
            combined: &self.combined,
            kd: &kd,
            ks: &ks,
            diffuse: &diffuse,
            specular: &specular,
            emitted: &emitted,
            face_id,
            level: &self.level,
        };
        let provenance = Provenance { comments: comments.to_owned(), camera: self.camera, origin: self.origin };
        Ok(write_render(path, &layers, &provenance)?.warning())
    }
}
