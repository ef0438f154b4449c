//! PNG files: the image as displayed.

use super::{atomic, tone_mapping};
use crate::error::Result;
use crate::scene::Display;
use crate::scene::camera::ImageSize;
use glam::Vec4;
use rayon::prelude::*;
use std::io::{self, BufWriter};
use std::path::Path;

/// Writes 8-bit sRGB: `combined` (linear RGB radiance, A coverage, top row first) exposed and tone-mapped.
///
/// Radiance is already zero where nothing covers the pixel, so that dropping A is compositing over black.
///
/// # Errors
/// [`crate::error::Error::Io`] naming the file.
///
/// # Panics
/// If `combined` has not one element a pixel.
pub fn write(path: &Path, size: ImageSize, combined: &[Vec4], display: &Display) -> Result<()> {
    assert_eq!(combined.len(), size.pixels(), "one value a pixel");
    let shown = |p: &Vec4| tone_mapping::display(p.truncate(), display.exposure, display.tone_mapping);
    let pixels: Vec<[u8; 3]> = combined.par_iter().map(shown).collect();
    write_bytes(path, size, pixels.as_flattened())
}

fn write_bytes(path: &Path, size: ImageSize, bytes: &[u8]) -> Result<()> {
    atomic::write(path, |file| {
        let mut encoder = ::png::Encoder::new(BufWriter::new(file), size.width, size.height);
        encoder.set_color(::png::ColorType::Rgb);
        encoder.set_depth(::png::BitDepth::Eight);
        encoder.set_source_srgb(::png::SrgbRenderingIntent::Perceptual);
        let mut writer = encoder.write_header().map_err(into_io)?;
        writer.write_image_data(bytes).map_err(into_io)?;
        writer.finish().map_err(into_io)
    })
}

fn into_io(error: ::png::EncodingError) -> io::Error {
    match error {
        ::png::EncodingError::IoError(e) => e,
        other => io::Error::other(other),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::ToneMapping;

    #[test]
    fn a_png_holds_what_is_displayed_and_says_srgb() {
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("a.png");
        let size = ImageSize { width: 3, height: 2 };
        let pixels: Vec<Vec4> = (0..6).map(|i| Vec4::new(i as f32 * 0.3, 0.1, 2.0, 1.0)).collect();
        let display = Display { exposure: -1.0, tone_mapping: ToneMapping::Reinhard };
        write(&path, size, &pixels, &display).expect("written");

        let reader = ::png::Decoder::new(io::BufReader::new(std::fs::File::open(&path).expect("file")));
        let mut reader = reader.read_info().expect("png");
        assert!(reader.info().srgb.is_some());
        let mut bytes = vec![0; reader.output_buffer_size().expect("size")];
        let info = reader.next_frame(&mut bytes).expect("pixels");
        assert_eq!((info.width, info.height, info.color_type), (3, 2, ::png::ColorType::Rgb));
        for (pixel, shown) in pixels.iter().zip(bytes.chunks_exact(3)) {
            assert_eq!(shown, tone_mapping::display(pixel.truncate(), -1.0, ToneMapping::Reinhard));
        }
    }
}
