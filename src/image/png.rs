//! PNG files: the image as displayed, written, and read back for comparison.

use super::exr::MAX_SIDE;
use super::{atomic, tone_mapping};
use crate::error::{Error, Result};
use crate::scene::Display;
use crate::scene::camera::ImageSize;
use crate::scene::report::Report;
use glam::Vec4;
use image::ImageReader;
use rayon::prelude::*;
use std::fs::File;
use std::io::{self, BufReader, BufWriter};
use std::path::Path;

/// Most memory that an image may take while it is decoded, bytes.
const MAX_BYTES: u64 = 2 << 30;

/// Writes 8-bit sRGB: `combined` (linear RGB radiance, A coverage, top row first) exposed and tone-mapped.
///
/// A is dropped: radiance where nothing covers the pixel is that of the environment behind, or zero.
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

/// Writes 8-bit sRGB as it is: R, G, B, a byte each, top row first.
///
/// # Errors
/// [`crate::error::Error::Io`] naming the file.
pub fn write_bytes(path: &Path, size: ImageSize, bytes: &[u8]) -> Result<()> {
    atomic::write(path, |file| encode(BufWriter::new(file), size, bytes))
}

/// Encodes 8-bit sRGB likewise, to wherever.
///
/// # Errors
/// What the writer says.
pub fn encode(to: impl io::Write, size: ImageSize, bytes: &[u8]) -> io::Result<()> {
    let mut encoder = ::png::Encoder::new(to, size.width, size.height);
    encoder.set_color(::png::ColorType::Rgb);
    encoder.set_depth(::png::BitDepth::Eight);
    encoder.set_source_srgb(::png::SrgbRenderingIntent::Perceptual);
    let mut writer = encoder.write_header().map_err(into_io)?;
    writer.write_image_data(bytes).map_err(into_io)?;
    writer.finish().map_err(into_io)
}

/// Reads a PNG as 8-bit sRGB, top row first; alpha is dropped.
///
/// # Errors
/// [`Error::Io`] if the file cannot be read, [`Error::Input`] if it is no PNG, is damaged or has more than [`MAX_SIDE`]
/// pixels a side; both name the file.
pub fn read(path: &Path) -> Result<(ImageSize, Vec<[u8; 3]>)> {
    let decoded = open(path)?.decode().map_err(|e| read_error(path, e))?;
    let size = ImageSize { width: decoded.width(), height: decoded.height() };
    Ok((size, decoded.into_rgb8().pixels().map(|p| p.0).collect()))
}

fn open(path: &Path) -> Result<ImageReader<BufReader<File>>> {
    let file = File::open(path).map_err(|e| Error::io(path, "cannot read", e))?;
    let mut reader = ImageReader::with_format(BufReader::new(file), image::ImageFormat::Png);
    let mut limits = image::Limits::default();
    (limits.max_image_width, limits.max_image_height) = (Some(MAX_SIDE), Some(MAX_SIDE));
    limits.max_alloc = Some(MAX_BYTES);
    reader.limits(limits);
    Ok(reader)
}

fn read_error(path: &Path, error: image::ImageError) -> Error {
    match error {
        image::ImageError::IoError(e) if e.kind() != io::ErrorKind::UnexpectedEof => Error::io(path, "cannot read", e),
        other => {
            let mut report = Report::default();
            report.error(path, None, format!("cannot be read as a PNG image: {other}"));
            Error::Input(report)
        }
    }
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
        let (read_size, read_back) = read(&path).expect("read");
        assert_eq!((read_size, read_back.as_flattened()), (size, bytes.as_slice()));
    }
}
