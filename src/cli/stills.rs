//! The images that a run drawn triangles behind.

use super::black_picture::Shown;
use crate::error::{Error, Result};
use crate::image::exr::{Provenance, RenderLayers, write_render};
use crate::image::film::{Film, jitter};
use crate::image::{FileFormat, png};
use crate::pass::{FrameOptions, Layers, Renderer, UpdateMode};
use crate::scene::camera::{Camera, View};
use crate::scene::{Display, Scene};
use glam::{DVec3, Vec2, Vec3, Vec4};
use std::path::Path;

/// What an image shows.
pub struct Shot<'a> {
    /// The view.
    pub view: &'a View,
    /// The camera that it comes from.
    pub camera: Camera,
    /// The point of the scene's files that is the origin.
    pub origin: DVec3,
    /// How it is displayed.
    pub display: Display,
    /// Level of each triangle by its id.
    pub levels: &'a [u8],
}

/// A finished image with its layers.
pub struct Still<'a> {
    shot: &'a Shot<'a>,
    combined: Vec<Vec4>,
    layers: Layers,
}

/// Redraws the present state of the light: the layers at pixel centres, and the combined image as the mean over `aa`
/// jittered redraws in linear light.
///
/// # Errors
/// The device is lost or memory runs out.
pub fn take<'a>(renderer: &mut Renderer, shot: &'a Shot<'a>, aa: u32) -> Result<Still<'a>> {
    let (view, display) = (shot.view, shot.display);
    if aa == 1 {
        let layers = renderer.read_layers()?;
        return Ok(Still { shot, combined: combined(&layers), layers });
    }
    let mut film = Film::new(view.size);
    // N points of a pixel stand for a square of 1/N of its area each.
    renderer.set_filter_width((aa as f32).sqrt().recip());
    for offset in jitter(aa) {
        film.add(&combined(&redraw(renderer, view, display, offset)?));
    }
    renderer.set_filter_width(1.0);
    let layers = redraw(renderer, view, display, Vec2::ZERO)?;
    Ok(Still { shot, combined: film.mean(), layers })
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
    /// What it shows of a scene whose lights count `factors` times what they were loaded with.
    #[must_use]
    pub const fn shown<'a>(&'a self, scene: &'a Scene, factors: &'a [Vec3]) -> Shown<'a> {
        let Shot { view, display, .. } = *self.shot;
        Shown { scene, view, display, factors, combined: self.combined.as_slice(), layers: &self.layers }
    }

    /// Writes one file, in the format that its name asks for; a warning where values could not be held.
    ///
    /// # Errors
    /// [`Error::Io`] naming the file.
    pub fn write(&self, path: &Path, comments: &str) -> Result<Option<String>> {
        match FileFormat::of(path) {
            Some(FileFormat::Png) => {
                png::write(path, self.shot.view.size, &self.combined, &self.shot.display).map(|()| None)
            }
            Some(FileFormat::Exr) => self.write_exr(path, comments),
            None => Err(Error::Usage(format!("{}: write .exr or .png", path.display()))),
        }
    }

    /// Splits above the triangle of id − 1; 0 where nothing is drawn.
    fn level_of(&self, drawn_id: u32) -> u32 {
        let level = drawn_id.checked_sub(1).and_then(|drawn| self.shot.levels.get(drawn as usize));
        level.map_or(0, |&level| level.into())
    }

    fn write_exr(&self, path: &Path, comments: &str) -> Result<Option<String>> {
        let vectors = |pixels: &[[f32; 3]]| pixels.iter().copied().map(Vec3::from_array).collect::<Vec<Vec3>>();
        let Layers { kd, ks, d, s, le, face_id, drawn_id, .. } = &self.layers;
        let [kd, ks, diffuse, specular, emitted] = [kd, ks, d, s, le].map(|layer| vectors(layer));
        let level: Vec<u32> = drawn_id.iter().map(|&id| self.level_of(id)).collect();
        let layers = RenderLayers {
            size: self.shot.view.size,
            combined: &self.combined,
            kd: &kd,
            ks: &ks,
            diffuse: &diffuse,
            specular: &specular,
            emitted: &emitted,
            face_id,
            level: &level,
        };
        let provenance =
            Provenance { comments: comments.to_owned(), camera: Some(self.shot.camera), origin: self.shot.origin };
        Ok(write_render(path, &layers, &provenance)?.warning())
    }
}
