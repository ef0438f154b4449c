//! `penombre diff`: how far an image is from a reference.

use super::args::DiffArgs;
use super::verdict::{Shown, Verdict};
use super::{Outcome, output};
use crate::error::{Error, Result};
use crate::image::metrics::{Epsilon, ZTest, compare, own_noise, z_test};
use crate::image::{FileFormat, atomic, error_picture, exr, flip, png};
use crate::math::luminance;
use crate::scene::camera::ImageSize;
use crate::scene::texture::srgb_to_linear;
use crate::scene::{Display, ToneMapping};
use glam::Vec3;
use std::path::Path;

/// What the mean of a reference is displayed as where nothing says otherwise: middle grey.
const MIDDLE_GREY: f64 = 0.18;

/// An image to compare.
struct Picture {
    size: ImageSize,
    /// Radiance of an EXR, displayed light (0 to 1) of a PNG.
    linear: Vec<Vec3>,
    /// The codes of a PNG.
    codes: Option<Vec<[u8; 3]>>,
    variance: Option<Vec<Vec3>>,
    mask: Option<Vec<bool>>,
    /// Pixels that have a value at all; `None` if all have.
    sampled: Option<Vec<bool>>,
}

/// Which pixels are compared.
struct Selection {
    /// Whether each counts; `None` if all do.
    counts: Option<Vec<bool>>,
    /// How many have no value in one of the images.
    not_sampled: usize,
}

/// Runs the command.
///
/// # Errors
/// An image that cannot be read, two that cannot be compared, or an output that cannot be written.
pub fn run(args: &DiffArgs) -> Result<Outcome> {
    args.check_outputs()?;
    let (image, reference) = (read(&args.image)?, read(&args.reference)?);
    check_alike(args, &image, &reference)?;
    let selection = select(args, &image, &reference)?;
    let verdict = judge(args, &image, &reference, &selection)?;
    if let Some(path) = &args.output {
        let epsilon = args.epsilon().resolve(verdict.reference_mean);
        let painted = error_picture::paint(&image.linear, &reference.linear, selection.counts.as_deref(), epsilon);
        png::write_bytes(path, image.size, painted.as_flattened())?;
    }
    output::print(&if args.json { verdict.json()? } else { verdict.text() })?;
    for line in verdict.complaints(&args.limits) {
        output::report(&line);
    }
    Ok(if verdict.exceeded.is_empty() { Outcome::Done } else { Outcome::LimitExceeded })
}

fn read(path: &Path) -> Result<Picture> {
    if FileFormat::of(path) == Some(FileFormat::Png) {
        let (size, codes) = png::read(path)?;
        let linear = codes.iter().map(|c| Vec3::from(c.map(|c| srgb_to_linear(f32::from(c) / 255.0)))).collect();
        return Ok(Picture { size, linear, codes: Some(codes), variance: None, mask: None, sampled: None });
    }
    let exr::RgbImage { size, rgb, variance, mask, sampled } = exr::read_rgb(path)?;
    Ok(Picture { size, linear: rgb, codes: None, variance, mask, sampled })
}

fn check_alike(args: &DiffArgs, image: &Picture, reference: &Picture) -> Result<()> {
    let (a, b) = (args.image.display(), args.reference.display());
    if image.size != reference.size {
        let [is, wanted] = [image.size, reference.size].map(|s| format!("{}x{}", s.width, s.height));
        return Err(Error::Usage(format!("{a} is {is}, {b} is {wanted}: make both the same size")));
    }
    if image.codes.is_some() != reference.codes.is_some() {
        let message = format!("{a}, {b}: an EXR holds radiance, a PNG what is displayed; compare two of a kind");
        return Err(Error::Usage(message));
    }
    if image.codes.is_some() && (args.exposure.is_some() || args.tone_mapping.is_some()) {
        let message = "--exposure and --tone-mapping are for EXR images: a PNG is displayed as it is";
        return Err(Error::Usage(message.to_owned()));
    }
    Ok(())
}

/// The pixels that count: those that both images have a value of, that the reference's mask lets count, and that the `--mask`
/// picture has at half white or above.
fn select(args: &DiffArgs, image: &Picture, reference: &Picture) -> Result<Selection> {
    let drawn = args.mask.as_deref().map(|path| drawn_mask(path, reference.size)).transpose()?;
    let has = |flags: &Option<Vec<bool>>, i: usize| flags.as_ref().is_none_or(|f| f[i]);
    let sampled = |i| has(&image.sampled, i) && has(&reference.sampled, i);
    let counts = |i| sampled(i) && has(&reference.mask, i) && has(&drawn, i);
    let all = 0..reference.size.pixels();
    let none = [&image.sampled, &reference.sampled, &reference.mask, &drawn].into_iter().all(Option::is_none);
    Ok(Selection {
        not_sampled: all.clone().filter(|&i| !sampled(i)).count(),
        counts: (!none).then(|| all.map(counts).collect()),
    })
}

/// What is half white or brighter in a picture of this size.
fn drawn_mask(path: &Path, wanted: ImageSize) -> Result<Vec<bool>> {
    let (size, codes) = png::read(path)?;
    if size != wanted {
        let [is, wanted] = [size, wanted].map(|s| format!("{}x{}", s.width, s.height));
        return Err(Error::Usage(format!("--mask {}: is {is}, the images are {wanted}", path.display())));
    }
    Ok(codes.iter().map(|&[r, g, b]| u32::from(r) + u32::from(g) + u32::from(b) >= 3 * 128).collect())
}

fn judge(args: &DiffArgs, image: &Picture, reference: &Picture, selection: &Selection) -> Result<Verdict> {
    let (mask, not_sampled) = (selection.counts.as_deref(), selection.not_sampled);
    if not_sampled > 0 && args.limits.max_flip.is_some() {
        let message =
            "--max-flip: FLIP looks at the surroundings of a pixel, and an image has a part of the pixels only";
        return Err(Error::Usage(message.to_owned()));
    }
    let metrics = compare(&image.linear, &reference.linear, mask, args.epsilon()).ok_or_else(|| {
        Error::Usage("no pixel is left to compare: all are masked, or NaN or infinite in one of the images".to_owned())
    })?;
    let display = image.codes.is_none().then(|| display(args, reference, mask));
    let variance = match (&image.variance, &reference.variance) {
        (Some(a), Some(b)) => Some(a.iter().zip(b).map(|(&a, &b)| a + b).collect()),
        (a, b) => a.as_ref().or(b.as_ref()).cloned(),
    };
    let z: Option<ZTest> = variance.and_then(|v: Vec<Vec3>| z_test(&image.linear, &reference.linear, &v, mask));
    let own = reference.variance.as_ref().and_then(|v| own_noise(&reference.linear, v, mask, args.epsilon()));
    let flip = (not_sampled == 0).then(|| {
        let [a, b] = [image, reference].map(|picture| codes(picture, display.as_ref()));
        flip::mean(&flip::error_map(&a, &b, image.size), mask).unwrap_or(0.0)
    });
    let mut verdict = Verdict {
        image: args.image.display().to_string(),
        reference: args.reference.display().to_string(),
        size: [image.size.width, image.size.height],
        counted: metrics.counted,
        masked: metrics.masked - not_sampled,
        not_sampled,
        masks: args.mask.iter().map(|_| "--mask").chain(reference.mask.iter().map(|_| "reference")).collect(),
        not_finite: metrics.not_finite,
        rmse: metrics.rmse,
        rmse_over_mean: ratio(metrics.rmse, metrics.reference_mean),
        relmse: metrics.relmse,
        relmse_epsilon: args.epsilon().resolve(metrics.reference_mean),
        own_relmse: own.map(|noise| noise.relmse),
        flip,
        shown: display.as_ref().map(Shown::new),
        max: metrics.max,
        mean_shift: metrics.mean_shift,
        reference_mean: metrics.reference_mean,
        z: z.map(Into::into),
        exceeded: Vec::new(),
    };
    verdict.exceeded = verdict.exceeded_of(&args.limits);
    Ok(verdict)
}

/// `None` against a black reference.
fn ratio(value: f64, mean: f64) -> Option<f64> {
    (mean > 0.0).then(|| value / mean)
}

/// How FLIP sees radiance: as asked, else with the reference's mean luminance at middle grey.
fn display(args: &DiffArgs, reference: &Picture, mask: Option<&[bool]>) -> Display {
    let counted = || {
        let pixels = reference.linear.iter().enumerate();
        pixels.filter(|(i, c)| mask.is_none_or(|m| m[*i]) && c.is_finite()).map(|(_, &c)| f64::from(luminance(c)))
    };
    let mean = counted().sum::<f64>() / counted().count().max(1) as f64;
    let middle = if mean > 0.0 { (MIDDLE_GREY / mean).log2().clamp(-64.0, 64.0) as f32 } else { 0.0 };
    Display { exposure: args.exposure.unwrap_or(middle), tone_mapping: args.tone_mapping.unwrap_or(ToneMapping::Aces) }
}

fn codes(picture: &Picture, display: Option<&Display>) -> Vec<[u8; 3]> {
    picture.codes.clone().unwrap_or_else(|| flip::displayed(&picture.linear, &display.copied().unwrap_or_default()))
}

impl DiffArgs {
    fn epsilon(&self) -> Epsilon {
        self.epsilon_absolute.map_or_else(Epsilon::default, Epsilon::Absolute)
    }

    /// Checks before any work that the picture can be written and replaces no input.
    fn check_outputs(&self) -> Result<()> {
        let Some(output) = &self.output else { return Ok(()) };
        atomic::check_writable(&[output])?;
        let inputs = [Some(&self.image), Some(&self.reference), self.mask.as_ref()];
        match inputs.into_iter().flatten().find(|input| atomic::is_same_file(input, output)) {
            Some(input) => Err(Error::Usage(format!("{}: is both an input and the output", input.display()))),
            None => Ok(()),
        }
    }
}
