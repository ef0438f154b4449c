//! The images that a run leaves behind.

use crate::error::{Error, Result};
use crate::image::exr::{Provenance, RenderLayers, write_render};
use crate::image::film::{Film, jitter};
use crate::image::{FileFormat, png};
use crate::pass::{FrameOptions, Layers, Renderer, UpdateMode};
use crate::scene::Display;
use crate::scene::camera::{Camera, View};
use glam::{Vec2, Vec3, Vec4};
use std::path::Path;

/// A finished image with its layers.
pub struct Still<'a> {
    view: &'a View,
    display: Display,
    combined: Vec<Vec4>,
    layers: Layers,
}

/// Redraws the present state of the light: the layers at pixel centres, and the combined image as the mean over `aa`
/// jittered redraws in linear light.
///
/// # Errors
/// The device is lost or memory runs out.
pub fn take<'a>(renderer: &mut Renderer, view: &'a View, display: Display, aa: u32) -> Result<Still<'a>> {
    if aa == 1 {
        let layers = renderer.read_layers()?;
        return Ok(Still { view, display, combined: combined(&layers), layers });
    }
    let mut film = Film::new(view.size);
    // N points of a pixel stand for a square of 1/N of its area each.
    renderer.set_filter_width((aa as f32).sqrt().recip());
    for offset in jitter(aa) {
        film.add(&combined(&redraw(renderer, view, display, offset)?));
    }
    renderer.set_filter_width(1.0);
    let layers = redraw(renderer, view, display, Vec2::ZERO)?;
    Ok(Still { view, display, combined: film.mean(), layers })
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

impl Still<'_> {
    /// Writes one file, in the format that its name asks for; a warning where values could not be held.
    ///
    /// # Errors
    /// [`Error::Io`] naming the file.
    pub fn write(&self, path: &Path, comments: &str, camera: Camera) -> Result<Option<String>> {
        match FileFormat::of(path) {
            Some(FileFormat::Png) => png::write(path, self.view.size, &self.combined, &self.display).map(|()| None),
            Some(FileFormat::Exr) => self.write_exr(path, comments, camera),
            None => Err(Error::Usage(format!("{}: write .exr or .png", path.display()))),
        }
    }

    fn write_exr(&self, path: &Path, comments: &str, camera: Camera) -> Result<Option<String>> {
        let vectors = |pixels: &[[f32; 3]]| pixels.iter().copied().map(Vec3::from_array).collect::<Vec<Vec3>>();
        let Layers { kd, ks, d, s, le, face_id, .. } = &self.layers;
        let [kd, ks, diffuse, specular, emitted] = [kd, ks, d, s, le].map(|layer| vectors(layer));
        // Nothing is split yet: every visible face is a base face.
        let level = vec![0; face_id.len()];
        let layers = RenderLayers {
            size: self.view.size,
            combined: &self.combined,
            kd: &kd,
            ks: &ks,
            diffuse: &diffuse,
            specular: &specular,
            emitted: &emitted,
            face_id,
            level: &level,
        };
        let provenance = Provenance { comments: comments.to_owned(), camera: Some(camera) };
        Ok(write_render(path, &layers, &provenance)?.warning())
    }
}
