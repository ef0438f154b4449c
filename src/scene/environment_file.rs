//! Pictures of an environment from files.

use super::environment::Picture;
use super::exr_header;
use super::texel::{MAX_VALUE, srgb_to_linear};
use super::textures::{enough_memory, extent};
use glam::Vec3;
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader};
use rayon::prelude::*;
use std::path::Path;

/// Bytes that a texel takes at most while a picture is made of it and light is prepared to be sampled, beside the decoded image.
const BYTES_A_TEXEL: u64 = 40;

/// A picture that was read.
#[derive(Debug)]
pub(super) struct Decoded {
    /// The picture, its radiance scaled.
    pub picture: Picture,
    /// What is to be said about it.
    pub warnings: Vec<String>,
}

/// Reads an equirectangular picture whose values, linear in a float format and by the sRGB curve in others, count times `scale`.
///
/// # Errors
/// What is wrong with the file.
pub(super) fn read(path: &Path, scale: Vec3) -> Result<Decoded, String> {
    let image = decode(path)?;
    let is_float = matches!(image, DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_));
    let size = [image.width(), image.height()];
    let pixels = image.into_rgb32f().into_raw();
    let mut texels: Vec<Vec3> = pixels.par_chunks_exact(3).map(Vec3::from_slice).collect();
    drop(pixels);
    if !is_float {
        texels.par_iter_mut().for_each(|texel| *texel = Vec3::from(texel.to_array().map(srgb_to_linear)));
    }
    let mut warnings = Vec::new();
    let cleaned = clean(&mut texels);
    if cleaned > 0 {
        let message = "pixels hold what no light can be (negative, infinite or not a number): they count as black, infinite ones as the brightest";
        warnings.push(format!("{cleaned} {message}"));
    }
    if size[0] != 2 * size[1] {
        let [width, height] = size;
        let message = "an equirectangular picture is twice as wide as high, and this one is stretched to be";
        warnings.push(format!("{width} × {height} pixels: {message}"));
    }
    texels.par_iter_mut().for_each(|texel| *texel = (*texel * scale).min(Vec3::splat(MAX_VALUE)));
    Ok(Decoded { picture: Picture::new(size, texels), warnings })
}

/// Makes light of what cannot be any; returns the number of texels that had some.
fn clean(texels: &mut [Vec3]) -> usize {
    let is_light = |c: f32| (0.0..=MAX_VALUE).contains(&c);
    let brightest = |texel: &Vec3| texel.to_array().into_iter().filter(|&c| is_light(c)).fold(0.0, f32::max);
    let most = texels.par_iter().map(brightest).reduce(|| 0.0, f32::max);
    let cleaned = |texel: &mut Vec3| {
        let is_clean = texel.to_array().into_iter().all(is_light);
        let clean = |c: f32| {
            if c > MAX_VALUE {
                most
            } else if c >= 0.0 {
                c
            } else {
                0.0
            }
        };
        *texel = Vec3::from(texel.to_array().map(clean));
        usize::from(!is_clean)
    };
    texels.par_iter_mut().map(cleaned).sum()
}

/// Decodes a file once it is known to fit.
fn decode(path: &Path) -> Result<DynamicImage, String> {
    let say = |error: &dyn std::fmt::Display| format!("{}: {error}", path.display());
    let data = std::fs::metadata(path).map_err(|e| say(&e))?;
    if !data.is_file() {
        return Err(say(&"is no file"));
    }
    // Opening may read the whole file.
    enough_memory(data.len()).map_err(|e| say(&e))?;
    let mut reader = ImageReader::open(path).and_then(ImageReader::with_guessed_format).map_err(|e| say(&e))?;
    if reader.format() == Some(ImageFormat::OpenExr) {
        let mut file = reader.into_inner();
        exr_header::check(&mut file).map_err(|e| say(&e))?;
        reader = ImageReader::with_format(file, ImageFormat::OpenExr);
    }
    // What it takes is asked below.
    reader.no_limits();
    let decoder = reader.into_decoder().map_err(|e| say(&e))?;
    let [width, height] = extent(&decoder).map_err(|e| say(&e))?;
    let need = data.len() + decoder.total_bytes() + u64::from(width) * u64::from(height) * BYTES_A_TEXEL;
    enough_memory(need).map_err(|why| say(&format!("{width} × {height} pixels: {why}")))?;
    DynamicImage::from_decoder(decoder).map_err(|e| say(&e))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_light_becomes_some() {
        let mut texels = [Vec3::new(1.0, f32::NAN, -2.0), Vec3::new(f32::INFINITY, 3.0, 0.0), Vec3::splat(7.0)];
        assert_eq!(clean(&mut texels), 2);
        assert_eq!(texels, [Vec3::new(1.0, 0.0, 0.0), Vec3::new(7.0, 3.0, 0.0), Vec3::splat(7.0)]);
    }
}
