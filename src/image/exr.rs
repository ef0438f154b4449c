//! EXR files: what `render` and `reference` write, and the colour of any EXR read back for comparison.
//!
//! Bytes depend on pixels and [`Provenance`] only: scan lines in increasing order, ZIP blocks of 16 lines (each is
//! deflated on its own, so threads change nothing), no date, and no attribute kept in a hash map.

use super::atomic;
use crate::error::{Error, Result};
use crate::scene::camera::{Camera, ImageSize, View};
use crate::scene::exr_header;
use crate::scene::report::Report;
use exr::prelude as file;
use exr::prelude::{FlatSamples, ReadChannels as _, ReadLayers as _, WritableImage as _};
use glam::{DVec3, Vec3, Vec4};
use half::f16;
use std::io;
use std::path::Path;

/// Largest width and height that [`read_rgb`] accepts, and that images can be asked for in.
pub const MAX_SIDE: u32 = 16_384;

/// Largest finite half.
const HALF_MAX: f32 = 65_504.0;

type Channel = file::AnyChannel<FlatSamples>;

/// What an image says of its own making. It goes into the file, so it must hold nothing that may differ between two
/// runs that make the same image: no output path, no thread count, no time.
#[derive(Clone, Debug, Default)]
pub struct Provenance {
    /// Free text for the attribute `comments`: the scene and the options that determine the image.
    pub comments: String,
    /// The camera, for `worldToCamera` and `fieldOfView`.
    pub camera: Option<Camera>,
    /// The point of the scene's files that is the camera's origin.
    pub origin: DVec3,
}

/// The image of `render` with its layers; every slice has one element a pixel, top row first.
#[derive(Clone, Copy, Debug)]
pub struct RenderLayers<'a> {
    /// Image size.
    pub size: ImageSize,
    /// `R G B A`: L_e + k_d D + k_s S, linear, mean over the pixel if anti-aliased; A is coverage.
    pub combined: &'a [Vec4],
    /// `kd.`: diffuse reflectance with textures, at the pixel centre as all below.
    pub kd: &'a [Vec3],
    /// `ks.`: specular reflectance.
    pub ks: &'a [Vec3],
    /// `D.`: diffuse luminance Σ E/π, W·sr⁻¹·m⁻².
    pub diffuse: &'a [Vec3],
    /// `S.`: specular luminance, W·sr⁻¹·m⁻².
    pub specular: &'a [Vec3],
    /// `Le.`: emitted radiance, W·sr⁻¹·m⁻².
    pub emitted: &'a [Vec3],
    /// `face.id`: `FaceId` + 1, 0 without geometry.
    pub face_id: &'a [u32],
    /// `level`: splits below the base mesh.
    pub level: &'a [u32],
}

/// The image of `reference`; every slice has one element a pixel, top row first.
#[derive(Clone, Copy, Debug)]
pub struct ReferenceLayers<'a> {
    /// Image size.
    pub size: ImageSize,
    /// `R G B A`: mean radiance and coverage.
    pub mean: &'a [Vec4],
    /// `variance.`: variance of the mean (not of one sample), (W·sr⁻¹·m⁻²)².
    pub variance: &'a [Vec3],
    /// `mask`: whether the pixel counts in comparisons (1) or is an emitter or background (0).
    pub mask: Option<&'a [bool]>,
    /// `sampled`: whether the pixel was looked at (1) or says nothing (0); `None` if all were.
    pub sampled: Option<&'a [bool]>,
}

/// Values that the file could not hold as they were.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Altered {
    /// Finite values beyond ±65504, written as that.
    pub clamped: u64,
    /// Infinities, written as ±65504 in half channels and as they are in 32-bit ones.
    pub infinite: u64,
    /// NaNs, written as 0 in half channels and as they are in 32-bit ones.
    pub nan: u64,
}

impl Altered {
    /// One line for the user; `None` when all is well.
    #[must_use]
    pub fn warning(&self) -> Option<String> {
        let parts = [
            (self.clamped, "beyond half range (clamped to 65504)"),
            (self.infinite, "infinite"),
            (self.nan, "not a number"),
        ];
        let found: Vec<String> =
            parts.iter().filter(|(count, _)| *count > 0).map(|(count, what)| format!("{count} {what}")).collect();
        if found.is_empty() { None } else { Some(format!("image values: {}", found.join(", "))) }
    }

    fn note(&mut self, value: f32) {
        self.nan += u64::from(value.is_nan());
        self.infinite += u64::from(value.is_infinite());
    }

    fn half(&mut self, value: f32) -> f16 {
        self.note(value);
        if value.is_nan() {
            return f16::ZERO;
        }
        self.clamped += u64::from(value.is_finite() && value.abs() > HALF_MAX);
        f16::from_f32(value.clamp(-HALF_MAX, HALF_MAX))
    }

    fn half_channel(&mut self, name: &str, values: impl Iterator<Item = f32>) -> Channel {
        Channel::new(name, FlatSamples::F16(values.map(|v| self.half(v)).collect()))
    }

    fn float_channel(&mut self, name: &str, values: impl Iterator<Item = f32>) -> Channel {
        let noted = values.inspect(|v| self.note(*v)).collect();
        Channel::new(name, FlatSamples::F32(noted))
    }
}

/// Writes the EXR of `render`: one part, colours half, ids unsigned integers.
///
/// # Errors
/// [`Error::Io`] naming the file.
///
/// # Panics
/// If a slice has not one element a pixel.
pub fn write_render(path: &Path, layers: &RenderLayers<'_>, provenance: &Provenance) -> Result<Altered> {
    let mut altered = Altered::default();
    let mut channels = Vec::new();
    for (i, name) in ["R", "G", "B", "A"].into_iter().enumerate() {
        channels.push(altered.half_channel(name, layers.combined.iter().map(|p| p[i])));
    }
    let colours =
        [("kd", layers.kd), ("ks", layers.ks), ("D", layers.diffuse), ("S", layers.specular), ("Le", layers.emitted)];
    for (layer, pixels) in colours {
        for (i, channel) in ["R", "G", "B"].into_iter().enumerate() {
            channels.push(altered.half_channel(&format!("{layer}.{channel}"), pixels.iter().map(|p| p[i])));
        }
    }
    channels.push(Channel::new("face.id", FlatSamples::U32(layers.face_id.to_vec())));
    channels.push(Channel::new("level", FlatSamples::U32(layers.level.to_vec())));
    write_channels(path, layers.size, channels, provenance)?;
    Ok(altered)
}

/// Writes the EXR of `reference`: 32-bit float mean and variance of the mean, and the mask as half.
///
/// # Errors
/// [`Error::Io`] naming the file.
///
/// # Panics
/// If a slice has not one element a pixel.
pub fn write_reference(path: &Path, layers: &ReferenceLayers<'_>, provenance: &Provenance) -> Result<Altered> {
    let mut altered = Altered::default();
    let mut channels = Vec::new();
    for (i, name) in ["R", "G", "B", "A"].into_iter().enumerate() {
        channels.push(altered.float_channel(name, layers.mean.iter().map(|p| p[i])));
    }
    for (i, name) in VARIANCE.into_iter().enumerate() {
        channels.push(altered.float_channel(name, layers.variance.iter().map(|p| p[i])));
    }
    for (name, flags) in [("mask", layers.mask), ("sampled", layers.sampled)] {
        if let Some(flags) = flags {
            channels.push(altered.half_channel(name, flags.iter().map(|&is| f32::from(u8::from(is)))));
        }
    }
    write_channels(path, layers.size, channels, provenance)?;
    Ok(altered)
}

const VARIANCE: [&str; 3] = ["variance.R", "variance.G", "variance.B"];

fn write_channels(path: &Path, size: ImageSize, channels: Vec<Channel>, provenance: &Provenance) -> Result<()> {
    for channel in &channels {
        assert_eq!(channel.sample_data.len(), size.pixels(), "channel {} has one value a pixel", channel.name);
    }
    let attributes = attributes(size, provenance);
    let channels = file::AnyChannels::sort(channels.into());
    let layer = file::Layer::new(
        (size.width as usize, size.height as usize),
        attributes,
        file::Encoding::SMALL_LOSSLESS,
        channels,
    );
    let image = file::Image::from_layer(layer);
    atomic::write(path, |f| image.write().to_unbuffered(f).map_err(into_io))
}

fn attributes(size: ImageSize, provenance: &Provenance) -> file::LayerAttributes {
    // OpenEXR's strings are UTF-8; the crate's own conversion panics beyond Latin-1.
    let text = |s: &str| (!s.is_empty()).then(|| file::Text::from_slice_unchecked(s.as_bytes()));
    let mut attributes = file::LayerAttributes {
        software_name: text(concat!("penombre ", env!("CARGO_PKG_VERSION"))),
        comments: text(&provenance.comments),
        ..Default::default()
    };
    if let Some(camera) = &provenance.camera {
        let half_height = (camera.vertical_fov.to_radians() * 0.5).tan();
        let half_width = half_height * size.width as f32 / size.height as f32;
        attributes.vertical_field_of_view = Some(camera.vertical_fov);
        attributes.horizontal_field_of_view = Some((half_width.atan() * 2.0).to_degrees());
        attributes.world_to_camera = Some(world_to_camera(&View::new(camera, size, 1.0), provenance.origin));
    }
    attributes
}

/// From the files' coordinates, whose point `origin` is the view's origin. OpenEXR's convention: row vectors (p' = p M), stored by rows; camera space has x right, y up, z forward.
fn world_to_camera(view: &View, origin: DVec3) -> [f32; 16] {
    let (r, u, f) = (view.right.normalize(), -view.down.normalize(), view.forward);
    let eye = view.eye.as_dvec3() + origin;
    let shift = [r, u, f].map(|axis| -axis.as_dvec3().dot(eye) as f32);
    #[rustfmt::skip]
    let rows = [
        r.x, u.x, f.x, 0.0,
        r.y, u.y, f.y, 0.0,
        r.z, u.z, f.z, 0.0,
        shift[0], shift[1], shift[2], 1.0,
    ];
    rows
}

fn into_io(error: exr::error::Error) -> io::Error {
    match error {
        exr::error::Error::Io(e) => e,
        other => io::Error::other(other.to_string()),
    }
}

/// Colour read from an EXR file, one element a pixel, top row first.
#[derive(Clone, Debug, PartialEq)]
pub struct RgbImage {
    /// Image size.
    pub size: ImageSize,
    /// Linear RGB; radiance in W·sr⁻¹·m⁻² in the program's own files.
    pub rgb: Vec<Vec3>,
    /// Variance of each value, in the square of its unit, where the file says (`variance.R` …).
    pub variance: Option<Vec<Vec3>>,
    /// Pixels that count in comparisons, where the file says (`mask` ≥ 0.5).
    pub mask: Option<Vec<bool>>,
    /// Pixels that have a value at all, where the file says (`sampled` ≥ 0.5).
    pub sampled: Option<Vec<bool>>,
}

impl RgbImage {
    /// Pixels that count in comparisons and have a value; `None` if all do.
    #[must_use]
    pub fn counted(&self) -> Option<Vec<bool>> {
        match (&self.mask, &self.sampled) {
            (Some(mask), Some(sampled)) => Some(mask.iter().zip(sampled).map(|(&a, &b)| a && b).collect()),
            (flags, None) | (None, flags) => flags.clone(),
        }
    }
}

/// Reads `R`, `G`, `B`, and `variance.`, `mask` and `sampled` where present, from the first part of any flat EXR file.
///
/// # Errors
/// [`Error::Io`] if the file cannot be read, [`Error::Input`] if it is no EXR, is damaged, lacks a channel or has
/// more than [`MAX_SIDE`] pixels a side; both name the file.
pub fn read_rgb(path: &Path) -> Result<RgbImage> {
    check_header(path)?;
    let image = file::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .from_file(path)
        .map_err(|e| read_error(path, e))?;
    let layer = &image.layer_data;
    let size = ImageSize { width: layer.size.width() as u32, height: layer.size.height() as u32 };
    let channel = |name: &str| layer.channel_data.list.iter().find(|c| c.name == *name).map(|c| &c.sample_data);
    let triple = |names: [&str; 3]| {
        let [r, g, b] = names.map(channel);
        let (r, g, b) = (r?, g?, b?);
        let values = r.values_as_f32().zip(g.values_as_f32()).zip(b.values_as_f32());
        Some(values.map(|((r, g), b)| Vec3::new(r, g, b)).collect::<Vec<_>>())
    };
    let rgb = triple(["R", "G", "B"]).ok_or_else(|| {
        let names: Vec<String> = layer.channel_data.list.iter().map(|c| c.name.to_string()).collect();
        refused(path, &format!("needs the channels R, G and B, has {}", names.join(", ")))
    })?;
    let flags = |name| channel(name).map(|flags| flags.values_as_f32().map(|v| v >= 0.5).collect());
    Ok(RgbImage { size, rgb, variance: triple(VARIANCE), mask: flags("mask"), sampled: flags("sampled") })
}

/// Looks at the sizes before anything of that size is allocated: a few bytes can claim any number of pixels.
fn check_header(path: &Path) -> Result<()> {
    let meta = file::MetaData::read_from_file(path, false).map_err(|e| read_error(path, e))?;
    for header in &meta.headers {
        let (width, height) = (header.layer_size.width(), header.layer_size.height());
        if width.max(height) > MAX_SIDE as usize {
            return Err(refused(path, &format!("{width}x{height} pixels; at most {MAX_SIDE} a side can be read")));
        }
        if header.channels.list.iter().any(|c| c.sampling != file::Vec2(1, 1)) {
            return Err(refused(path, "has subsampled channels; save it with full-resolution R, G and B"));
        }
    }
    let mut file = std::fs::File::open(path).map_err(|e| Error::io(path, "cannot read", e))?;
    exr_header::check(&mut file).map_err(|fault| refused(path, &fault))
}

fn read_error(path: &Path, error: exr::error::Error) -> Error {
    use io::ErrorKind::{InvalidData, InvalidInput, UnexpectedEof};
    match error {
        // Offsets in a damaged file lead anywhere.
        exr::error::Error::Io(e) if matches!(e.kind(), InvalidInput | InvalidData | UnexpectedEof) => {
            refused(path, &format!("cannot be read as an EXR image: it is cut off or damaged ({e})"))
        }
        exr::error::Error::Io(e) => Error::io(path, "cannot read", e),
        other => refused(path, &format!("cannot be read as an EXR image: {other}")),
    }
}

fn refused(path: &Path, message: &str) -> Error {
    let mut report = Report::default();
    report.error(path, None, message);
    Error::Input(report)
}
