//! Which faces a view shows.

use crate::error::Result;
use crate::image::film;
use crate::pass::Renderer;
use crate::refine::pixel_lists::FaceImage;
use crate::scene::FaceId;
use crate::scene::camera::View;
use glam::Vec2;

/// Finds what the camera sees: the union over the jitters of the written image, pixels averaged; and which face each pixel's centre
/// sees.
///
/// # Errors
/// The device is lost or memory runs out.
pub fn visible_faces(renderer: &mut Renderer, view: &View, aa: u32) -> Result<(Vec<(FaceId, u32)>, FaceImage)> {
    let offsets = film::jitter(aa);
    let mut all: Vec<(FaceId, u32)> = Vec::new();
    for &offset in offsets.iter().rev() {
        renderer.set_view(view, offset);
        all.extend(renderer.visibility()?);
    }
    if aa > 1 {
        renderer.set_view(view, Vec2::ZERO);
        all.extend(renderer.visibility()?);
    }
    all.sort_unstable();
    let mut merged: Vec<(FaceId, u32)> = Vec::with_capacity(all.len());
    for (face, pixels) in all {
        match merged.last_mut() {
            Some((last, sum)) if *last == face => *sum += pixels,
            _ => merged.push((face, pixels)),
        }
    }
    let redraws = if aa > 1 { aa + 1 } else { 1 };
    merged.iter_mut().for_each(|(_, pixels)| *pixels = pixels.div_ceil(redraws));
    Ok((merged, FaceImage { view: *view, faces: renderer.face_ids().into() }))
}
