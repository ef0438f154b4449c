//! Decoding texture files and filtering their mip chains, each once, in parallel.

use super::find_file::{Finder, Found};
use super::report::Report;
use super::texture::{Texture, TextureId};
use rayon::prelude::*;
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};

/// Largest width and height, texels.
const MAX_SIDE: u32 = 16384;
/// Most memory that one image may take while it is decoded, bytes.
const MAX_BYTES: u64 = 512 << 20;

/// What an image is for: one file may be both a colour and a mask.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Role {
    /// RGB counts, alpha is ignored.
    Colour,
    /// One channel counts: alpha where it says something, else luminance.
    Mask,
}

/// A texture that a material asks for.
#[derive(Clone, Debug)]
pub(super) struct Request {
    /// Names that the file may have, in the order in which they are tried.
    pub names: Vec<String>,
    /// The MTL file.
    pub file: PathBuf,
    /// Line of the statement.
    pub line: u32,
    /// What it is for.
    pub role: Role,
}

impl Request {
    /// The name that messages say.
    fn name(&self) -> &str {
        self.names.last().map_or("", String::as_str)
    }

    /// Where the file is, and what is to be said of one that stands in for it.
    fn find(&self, finder: &mut Finder) -> (Option<PathBuf>, Option<String>) {
        match finder.texture(directory_of(&self.file), &self.names) {
            Some(Found::Named(path)) => (Some(path), None),
            Some(Found::OtherFormat(path)) => {
                let message = format!("texture: there is no file {:?}: {} is used", self.name(), path.display());
                (Some(path), Some(message))
            }
            None => (None, None),
        }
    }
}

fn directory_of(file: &Path) -> &Path {
    file.parent().unwrap_or(Path::new(""))
}

/// Decodes all `requests`; the answer has the texture of each, or `None` where it is missing or broken (one warning each
/// file).
pub(super) fn decode_all(requests: &[Request], report: &mut Report) -> (Vec<Texture>, Vec<Option<TextureId>>) {
    let mut jobs: Vec<(Option<PathBuf>, &Request)> = Vec::new();
    let mut known: HashMap<(PathBuf, Role), usize> = HashMap::new();
    let mut finder = Finder::default();
    let mut noted = HashSet::new();
    let job_of: Vec<usize> = requests
        .iter()
        .map(|request| {
            let (path, note) = request.find(&mut finder);
            if let Some(message) = note.filter(|message| noted.insert(message.clone())) {
                report.warn(&request.file, Some(request.line), message);
            }
            let key = path.clone().unwrap_or_else(|| directory_of(&request.file).join(request.name()));
            *known.entry((key, request.role)).or_insert_with(|| {
                jobs.push((path, request));
                jobs.len() - 1
            })
        })
        .collect();
    let decoded: Vec<_> = jobs
        .par_iter()
        .map(|(path, request)| match path {
            Some(path) => decode(path, request.role),
            None => Err(format!("there is no file {:?}", request.name())),
        })
        .collect();
    let mut textures = Vec::new();
    let mut ids = Vec::new();
    for (result, (_, request)) in decoded.into_iter().zip(&jobs) {
        ids.push(match result {
            Ok(texture) => {
                textures.push(texture);
                Some(TextureId(textures.len() as u32 - 1))
            }
            Err(why) => {
                let message = format!("texture: {why}: the constant is used");
                report.warn(&request.file, Some(request.line), message);
                None
            }
        });
    }
    let answers = job_of.into_iter().map(|job| ids[job]).collect();
    (textures, answers)
}

fn decode(path: &Path, role: Role) -> Result<Texture, String> {
    let say = |error: &dyn std::fmt::Display| format!("{}: {error}", path.display());
    // Decoders may hold the whole file.
    if std::fs::metadata(path).map_err(|e| say(&e))?.len() > MAX_BYTES {
        return Err(say(&"the file is larger than 512 MiB"));
    }
    let reader = image::ImageReader::open(path).map_err(|e| say(&e))?;
    let mut reader = reader.with_guessed_format().map_err(|e| say(&e))?;
    let mut limits = image::Limits::default();
    limits.max_image_width = Some(MAX_SIDE);
    limits.max_image_height = Some(MAX_SIDE);
    limits.max_alloc = Some(MAX_BYTES);
    reader.limits(limits);
    let image = reader.decode().map_err(|e| say(&e))?;
    if image.width() == 0 || image.height() == 0 {
        return Err(say(&"the image has no pixels"));
    }
    let texels = match role {
        Role::Colour => colour_texels(&image),
        Role::Mask => mask_texels(&image),
    };
    Ok(Texture::new(path.display().to_string(), [image.width(), image.height()], texels))
}

fn colour_texels(image: &image::DynamicImage) -> Vec<[u8; 4]> {
    match image {
        // Radiance files hold linear values; texels are sRGB-encoded.
        image::DynamicImage::ImageRgb32F(linear) => linear
            .pixels()
            .map(|p| {
                let [r, g, b] = p.0.map(encode_srgb);
                [r, g, b, 255]
            })
            .collect(),
        image::DynamicImage::ImageRgb8(rgb) => rgb.pixels().map(|p| [p.0[0], p.0[1], p.0[2], 255]).collect(),
        other => other.to_rgb8().pixels().map(|p| [p.0[0], p.0[1], p.0[2], 255]).collect(),
    }
}

/// sRGB code of a linear value (IEC 61966-2-1).
fn encode_srgb(linear: f32) -> u8 {
    let c = linear.clamp(0.0, 1.0);
    let encoded = if c <= 0.003_130_8 { 12.92 * c } else { 1.055 * c.powf(1.0 / 2.4) - 0.055 };
    (encoded * 255.0).round() as u8
}

/// Alpha holds the mask: the image's own where it is not one constant, else its luminance. Codes count as linear.
fn mask_texels(image: &image::DynamicImage) -> Vec<[u8; 4]> {
    if image.color().has_alpha() {
        let rgba = image.to_rgba8();
        let first = rgba.get_pixel(0, 0).0[3];
        if rgba.pixels().any(|p| p.0[3] != first) {
            return rgba.pixels().map(|p| [255, 255, 255, p.0[3]]).collect();
        }
    }
    image.to_luma8().pixels().map(|p| [255, 255, 255, p.0[0]]).collect()
}
