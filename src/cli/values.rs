//! Parsers of option values; each message says what is wrong and what would be right.

use crate::bake::baker::{Sides, Triangles};
use crate::estimate::hemisphere::Method;
use crate::image::FileFormat;
use crate::image::exr::MAX_SIDE;
use crate::pass::{DepthFormat, DepthOrder, UpdateMode};
use crate::refine::options::{Piece, Priority};
use crate::scene::ToneMapping;
use crate::scene::camera::ImageSize;
use crate::scene::up_axis::UpAxis;
use crate::session::{PixelCounts, Quality};
use crate::vk::Vsync;
use clap::ValueEnum;
use clap::builder::{PathBufValueParser, PossibleValue, PossibleValuesParser, TypedValueParser};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Longest time that can be asked for, seconds (a year): keeps clock arithmetic far from overflow.
const MAX_SECONDS: f64 = 365.0 * 86_400.0;

/// `WxH`, each from 1 to [`MAX_SIDE`].
pub fn size(text: &str) -> Result<ImageSize, String> {
    let form = || format!("expected WIDTHxHEIGHT in pixels, as in 1024x768, each from 1 to {MAX_SIDE}");
    let (width, height) = text.split_once(['x', 'X']).ok_or_else(form)?;
    let side = |s: &str| s.parse().ok().filter(|n| (1..=MAX_SIDE).contains(n)).ok_or_else(form);
    Ok(ImageSize { width: side(width)?, height: side(height)? })
}

/// A time in seconds, > 0.
pub fn seconds(text: &str) -> Result<Duration, String> {
    duration(text, 1.0).ok_or_else(|| "expected seconds, more than 0 and at most a year, as in 0.5 or 60".to_owned())
}

/// A time in milliseconds, > 0.
pub fn milliseconds(text: &str) -> Result<Duration, String> {
    duration(text, 1e-3).ok_or_else(|| "expected milliseconds, more than 0, as in 40".to_owned())
}

fn duration(text: &str, unit: f64) -> Option<Duration> {
    let seconds = text.parse::<f64>().ok()? * unit;
    // At least a nanosecond, so that it does not round to nothing.
    (1e-9..=MAX_SECONDS).contains(&seconds).then(|| Duration::from_secs_f64(seconds))
}

/// A finite number > 0.
pub fn positive(text: &str) -> Result<f32, String> {
    let value = text.parse::<f32>().ok().filter(|v| v.is_finite() && *v > 0.0);
    value.ok_or_else(|| "expected a number more than 0, as in 0.01".to_owned())
}

/// A finite number > 0, in double precision.
pub fn positive_precisely(text: &str) -> Result<f64, String> {
    let value = text.parse::<f64>().ok().filter(|v| v.is_finite() && *v > 0.0);
    value.ok_or_else(|| "expected a number more than 0, as in 0.01".to_owned())
}

/// A share from 0 up to 1, that left out.
pub fn share(text: &str) -> Result<f64, String> {
    let value = text.parse::<f64>().ok().filter(|v| (0.0..1.0).contains(v));
    value.ok_or_else(|| "expected a share of 0 or more and less than 1, as in 0.01".to_owned())
}

/// A finite number ≥ 0.
pub fn limit(text: &str) -> Result<f64, String> {
    let value = text.parse::<f64>().ok().filter(|v| v.is_finite() && *v >= 0.0);
    value.ok_or_else(|| "expected a number of 0 or more, as in 0.01".to_owned())
}

/// An exposure that leaves half-float radiance inside what f32 holds.
pub fn stops(text: &str) -> Result<f32, String> {
    let value = text.parse::<f32>().ok().filter(|v| (-64.0..=64.0).contains(v));
    value.ok_or_else(|| "expected stops from -64 to 64, as in 1.5".to_owned())
}

/// A path, whatever its bytes, that `check` has nothing against.
fn path(check: fn(&Path) -> Result<(), &'static str>) -> impl TypedValueParser<Value = PathBuf> {
    PathBufValueParser::new().try_map(move |path| check(&path).map(|()| path))
}

/// An image file that can be written.
pub fn image_path() -> impl TypedValueParser<Value = PathBuf> {
    path(|path| match FileFormat::of(path) {
        Some(_) => Ok(()),
        None => Err("its extension must be .exr (linear, with layers) or .png (as displayed)"),
    })
}

/// An EXR file.
pub fn exr_path() -> impl TypedValueParser<Value = PathBuf> {
    path(|path| match FileFormat::of(path) {
        Some(FileFormat::Exr) => Ok(()),
        _ => Err("its extension must be .exr: a reference is linear 32-bit float"),
    })
}

/// A PNG file.
pub fn png_path() -> impl TypedValueParser<Value = PathBuf> {
    path(|path| match FileFormat::of(path) {
        Some(FileFormat::Png) => Ok(()),
        _ => Err("its extension must be .png"),
    })
}

/// A mesh file that can be written.
pub fn mesh_path() -> impl TypedValueParser<Value = PathBuf> {
    path(|path| {
        let is_known = has_extension(path, "ply") || has_extension(path, "glb");
        if is_known { Ok(()) } else { Err("its extension must be .ply or .glb (binary glTF)") }
    })
}

/// Whose triangles a bake has, by name.
pub fn baked_triangles() -> impl TypedValueParser<Value = Triangles> {
    named(Triangles::NAMES)
}

/// Sides of a bake, by name.
pub fn baked_sides() -> impl TypedValueParser<Value = Sides> {
    named(Sides::NAMES)
}

/// An SVG file.
pub fn svg_path() -> impl TypedValueParser<Value = PathBuf> {
    path(|path| if has_extension(path, "svg") { Ok(()) } else { Err("its extension must be .svg") })
}

/// A CSV file; the extension is required since the summary takes the same name with `.json`.
pub fn csv_path() -> impl TypedValueParser<Value = PathBuf> {
    path(|path| {
        if has_extension(path, "csv") {
            return Ok(());
        }
        Err("its extension must be .csv; the summary goes beside it as .json")
    })
}

/// A JSON file.
pub fn json_path() -> impl TypedValueParser<Value = PathBuf> {
    path(|path| if has_extension(path, "json") { Ok(()) } else { Err("its extension must be .json") })
}

fn has_extension(path: &Path, extension: &str) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case(extension))
}

/// One of the names of a list.
fn named<T: Copy + Send + Sync + 'static, const N: usize>(
    names: [(&'static str, T); N],
) -> impl TypedValueParser<Value = T> {
    PossibleValuesParser::new(names.map(|(name, _)| name)).try_map(move |name| {
        let found = names.iter().find(|(n, _)| *n == name);
        found.map(|(_, value)| *value).ok_or("unknown name")
    })
}

/// One of [`ToneMapping::NAMES`].
pub fn tone_mapping() -> impl TypedValueParser<Value = ToneMapping> {
    named(ToneMapping::NAMES)
}

/// Whether pictures wait for the display, by name.
pub fn vsync() -> impl TypedValueParser<Value = Vsync> {
    named(Vsync::NAMES)
}

/// A priority by name.
pub fn priority() -> impl TypedValueParser<Value = Priority> {
    named(Priority::NAMES)
}

/// A scene with its reference.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AblatedScene {
    /// Scene file (.toml) or bare .obj, .gltf or .glb.
    pub path: PathBuf,
    /// What errors are measured against.
    pub reference: PathBuf,
    /// Camera of the scene file; `None` for the first.
    pub camera: Option<String>,
}

/// A scene with its reference and, behind that, its camera.
pub fn ablated_scene(text: &str) -> Result<AblatedScene, String> {
    let form = || "expected SCENE=REF.exr or SCENE=REF.exr@CAMERA, as in box.toml=box.exr@left".to_owned();
    let is_exr = |text: &str| FileFormat::of(Path::new(text)) == Some(FileFormat::Exr);
    let (scene, rest) = text.split_once('=').filter(|(scene, _)| !scene.is_empty()).ok_or_else(form)?;
    let (reference, camera) = match rest.rsplit_once('@') {
        Some((reference, camera)) if is_exr(reference) => (reference, Some(camera.to_owned())),
        _ => (rest, None),
    };
    let found = AblatedScene { path: scene.into(), reference: reference.into(), camera };
    if is_exr(reference) { Ok(found) } else { Err(form()) }
}

/// A scene, with its reference if there is one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ClockedScene {
    /// Scene file (.toml) or bare .obj, .gltf or .glb.
    pub path: PathBuf,
    /// What errors are measured against.
    pub reference: Option<PathBuf>,
    /// Camera of the scene file; `None` for the first.
    pub camera: Option<String>,
}

impl ClockedScene {
    /// What it is called in messages and tables.
    #[must_use]
    pub fn name(&self) -> String {
        let camera = self.camera.as_ref().map_or_else(String::new, |camera| format!("@{camera}"));
        self.path.display().to_string() + &camera
    }
}

/// A scene and, behind it, its reference and its camera, or one of them.
pub fn clocked_scene(text: &str) -> Result<ClockedScene, String> {
    if let Ok(AblatedScene { path, reference, camera }) = ablated_scene(text) {
        return Ok(ClockedScene { path, reference: Some(reference), camera });
    }
    let is_scene =
        |text: &str| ["toml", "obj", "gltf", "glb"].iter().any(|extension| has_extension(Path::new(text), extension));
    let (path, camera) = match text.rsplit_once('@') {
        Some((path, camera)) if is_scene(path) => (path, Some(camera.to_owned())),
        _ => (text, None),
    };
    if is_scene(path) {
        return Ok(ClockedScene { path: path.into(), reference: None, camera });
    }
    Err("expected SCENE, SCENE@CAMERA, SCENE=REF.exr or SCENE=REF.exr@CAMERA, SCENE being a .toml, .obj, .gltf or .glb, as in \
        box.toml=box.exr@left"
        .to_owned())
}

/// A piece of the engine by name.
pub fn piece() -> impl TypedValueParser<Value = Piece> {
    named(Piece::NAMES)
}

/// A preset of quality, by name.
pub fn quality() -> impl TypedValueParser<Value = Quality> {
    named(Quality::NAMES)
}

impl ValueEnum for PixelCounts {
    fn value_variants<'a>() -> &'a [Self] {
        &[Self::Image, Self::Query, Self::Atomic, Self::Off]
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        let (name, help) = match self {
            Self::Image => ("image", "All of them on the CPU, from the image of face ids"),
            Self::Query => ("query", "The largest changed ones, by occlusion queries"),
            Self::Atomic => ("atomic", "The changed ones as they are drawn, by counters"),
            Self::Off => ("off", "Not at all"),
        };
        let value = PossibleValue::new(name).help(help);
        // Its name until 0.1, when an image of triangle ids was read back with each picture.
        Some(if *self == Self::Image { value.alias("histogram") } else { value })
    }
}

/// The axis that points up, by name.
pub fn up_axis() -> impl TypedValueParser<Value = UpAxis> {
    named(UpAxis::NAMES)
}

/// A hemisphere method by name.
pub fn hemisphere() -> impl TypedValueParser<Value = Method> {
    named(Method::NAMES)
}

/// A finite number that is not negative.
pub fn not_negative(text: &str) -> Result<f32, String> {
    let value: f32 = text.parse().map_err(|_| "not a number".to_owned())?;
    if value.is_finite() && value >= 0.0 { Ok(value) } else { Err("must be 0 or more".to_owned()) }
}

/// A depth format by name.
pub fn depth_format() -> impl TypedValueParser<Value = DepthFormat> {
    named(DepthFormat::NAMES)
}

/// An order of depths by name.
pub fn depth_order() -> impl TypedValueParser<Value = DepthOrder> {
    named(DepthOrder::NAMES)
}

/// An update mode by name.
pub fn update_mode() -> impl TypedValueParser<Value = UpdateMode> {
    let names = UpdateMode::ALL.map(UpdateMode::name);
    PossibleValuesParser::new(names).try_map(|name| UpdateMode::named(&name).ok_or("unknown mode"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::ffi::OsStr;

    #[test]
    fn sizes() {
        assert_eq!(size("1x16384"), Ok(ImageSize { width: 1, height: 16_384 }));
        for bad in ["", "x", "640", "0x1", "16385x1", "-1x1", "640x480x3", "6 4x1", "1e3x1", "99999999999x1"] {
            assert!(size(bad).is_err_and(|m| m.contains("1024x768")), "{bad}");
        }
    }

    #[test]
    fn times() {
        assert_eq!(seconds("0.5"), Ok(Duration::from_millis(500)));
        assert_eq!(milliseconds("40"), Ok(Duration::from_millis(40)));
        for bad in ["0", "-1", "nan", "inf", "1e300", "1e-12", "ten", ""] {
            assert!(seconds(bad).is_err(), "{bad}");
            assert!(milliseconds(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn numbers() {
        assert_eq!(positive("0.01"), Ok(0.01));
        assert_eq!(limit("0"), Ok(0.0));
        assert!(limit("-1").is_err() && limit("nan").is_err() && limit("inf").is_err());
        assert_eq!(stops("-1.5"), Ok(-1.5));
        assert_eq!((share("0"), share("0.5")), (Ok(0.0), Ok(0.5)));
        assert!(["1", "-0.1", "nan", "1 %"].iter().all(|bad| share(bad).is_err()));
        for bad in ["0", "-1", "nan", "inf", "1e39"] {
            assert!(positive(bad).is_err(), "{bad}");
        }
        for bad in ["65", "nan", "-inf"] {
            assert!(stops(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn scenes_with_references() {
        let parts = |text| {
            let AblatedScene { path, reference, camera } = ablated_scene(text).ok()?;
            Some((path.to_str()?.to_owned(), reference.to_str()?.to_owned(), camera.unwrap_or_default()))
        };
        let of = |path: &str, reference: &str, camera: &str| Some((path.into(), reference.into(), camera.into()));
        assert_eq!(parts("a/b.toml=c.exr"), of("a/b.toml", "c.exr", ""));
        assert_eq!(parts("b.obj=d@e/c.EXR@left"), of("b.obj", "d@e/c.EXR", "left"));
        assert_eq!(parts("b.obj=d@e/c.exr"), of("b.obj", "d@e/c.exr", ""));
        assert!(
            ["", "b.toml", "=c.exr", "b.toml=", "b.toml=c.png", "b.toml@left"].iter().all(|bad| parts(bad).is_none())
        );
    }

    #[test]
    fn scenes_with_or_without_references() {
        let parts = |text| {
            let scene = clocked_scene(text).ok()?;
            Some((scene.name(), scene.reference.map_or_else(String::new, |path| path.display().to_string())))
        };
        let of = |name: &str, reference: &str| Some((name.to_owned(), reference.to_owned()));
        assert_eq!(parts("a/b.toml=c.exr"), of("a/b.toml", "c.exr"));
        assert_eq!(parts("b.obj=d@e/c.EXR@left"), of("b.obj@left", "d@e/c.EXR"));
        assert_eq!((parts("a/b.toml"), parts("d@e/b.OBJ@left")), (of("a/b.toml", ""), of("d@e/b.OBJ@left", "")));
        assert_eq!(parts("d@e/b.obj"), of("d@e/b.obj", ""));
        assert!(
            ["", "b", "=c.exr", "b.toml=", "b.toml=c.png", "c.exr", "b@left"].iter().all(|bad| parts(bad).is_none())
        );
    }

    #[test]
    fn paths() {
        fn is_taken(parser: &impl TypedValueParser, path: impl AsRef<OsStr>) -> bool {
            parser.parse_ref(&clap::Command::new("test"), None, path.as_ref()).is_ok()
        }
        let image = image_path();
        assert!(["a.EXR", "b.c/a.png"].iter().all(|path| is_taken(&image, path)));
        assert!(["", "a", "a.jpg", "exr", ".exr", "a.exr/b"].iter().all(|path| !is_taken(&image, path)));
        assert!(is_taken(&exr_path(), "a.exr") && !is_taken(&exr_path(), "a.png"));
        assert!(is_taken(&png_path(), "a.PNG") && !is_taken(&png_path(), "a.exr"));
        assert!(is_taken(&csv_path(), "a.csv") && !is_taken(&csv_path(), "a.json"));
        assert!(is_taken(&json_path(), "a.json") && !is_taken(&json_path(), "a.csv"));
        assert!(is_taken(&svg_path(), "a.SVG") && !is_taken(&svg_path(), "a.png"));
    }
}
