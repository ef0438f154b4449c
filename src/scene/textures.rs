//! Decoding texture files and filtering their mip chains, each once, in parallel.

use super::exr_header;
use super::find_file::{Finder, Found};
use super::map_options::MapOptions;
use super::material::TextureMap;
use super::memory;
use super::mipmap;
use super::report::Report;
use super::texel_source::{self, Recipe};
use super::texture::{Texture, TextureId, Wrap};
use glam::{Mat2, Vec2};
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader};
use rayon::prelude::*;
use std::collections::{HashMap, HashSet};
use std::io::{BufRead, Cursor, Seek};
use std::path::{Path, PathBuf};

/// Largest width and height, texels.
pub(super) const MAX_SIDE: u32 = 16384;
/// Images that need more memory than this are decoded one after the other, where there is as much, bytes.
const LARGE: u64 = 256 << 20;
/// Most memory for an image where the system does not say how much there is, bytes.
const UNKNOWN_MEMORY: u64 = 4 << 30;

/// Where an image is.
#[derive(Clone, Debug)]
pub(super) enum ImageAt<'a> {
    /// In a file, with the names that it may have, in the order in which they are tried.
    Named(Vec<String>),
    /// In the file that asks for it, as messages call it.
    Within(String, &'a [u8]),
}

/// How a texture is looked up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Placing {
    /// See [`TextureMap::matrix`].
    pub matrix: Mat2,
    /// See [`TextureMap::offset`].
    pub offset: Vec2,
    /// See [`TextureMap::wrap`].
    pub wrap: [Wrap; 2],
}

impl From<&MapOptions> for Placing {
    /// What the options of an MTL statement ask for.
    fn from(options: &MapOptions) -> Self {
        let wrap = if options.clamp { Wrap::Clamp } else { Wrap::Repeat };
        let matrix = Mat2::from_diagonal(Vec2::from(options.scale));
        Self { matrix, offset: Vec2::from(options.offset), wrap: [wrap; 2] }
    }
}

/// A texture that a material asks for.
#[derive(Clone, Debug)]
pub(super) struct Request<'a> {
    /// Where it is.
    pub image: ImageAt<'a>,
    /// The file that asks.
    pub file: PathBuf,
    /// Line of the statement.
    pub line: Option<u32>,
    /// What it is for.
    pub recipe: Recipe,
    /// How it is looked up.
    pub placing: Placing,
}

impl Request<'_> {
    /// The name that messages say.
    fn name(&self) -> &str {
        match &self.image {
            ImageAt::Named(names) => names.last().map_or("", String::as_str),
            ImageAt::Within(name, _) => name,
        }
    }

    /// Where the file is, and what is to be said of one that stands in for it.
    fn find(&self, finder: &mut Finder) -> (Option<PathBuf>, Option<String>) {
        let ImageAt::Named(names) = &self.image else { return (Some(self.file.clone()), None) };
        match finder.texture(directory_of(&self.file), names) {
            Some(Found::Named(path)) => (Some(path), None),
            Some(Found::OtherFormat(path)) => {
                let message = format!("texture: there is no file {:?}: {} is used", self.name(), path.display());
                (Some(path), Some(message))
            }
            None => (None, None),
        }
    }

    /// What tells images apart: the file, and which of those within it.
    fn key(&self, path: Option<&Path>) -> (PathBuf, Option<String>) {
        match &self.image {
            ImageAt::Named(_) => {
                (path.map_or_else(|| directory_of(&self.file).join(self.name()), Path::to_owned), None)
            }
            ImageAt::Within(name, _) => (self.file.clone(), Some(name.clone())),
        }
    }

    fn map(&self, texture: TextureId) -> TextureMap {
        let Placing { matrix, offset, wrap } = self.placing;
        TextureMap { texture, matrix, offset, wrap }
    }
}

fn directory_of(file: &Path) -> &Path {
    file.parent().unwrap_or(Path::new(""))
}

/// A file, and all that is asked of it.
struct Job<'a> {
    path: Option<PathBuf>,
    first: &'a Request<'a>,
    recipes: Vec<Recipe>,
}

/// Textures of a file, and the one of each recipe.
type Decoded = (Vec<Texture>, Vec<Option<usize>>);

/// Decodes all `requests`; the answer has the texture of each, or `None` where it is missing or broken (one warning each
/// file), or where the file has nothing to say in that role.
pub(super) fn decode_all(requests: &[Request<'_>], report: &mut Report) -> (Vec<Texture>, Vec<Option<TextureMap>>) {
    let (jobs, places) = jobs(requests, report);
    let mut textures = Vec::new();
    let mut ids: Vec<Vec<Option<TextureId>>> = Vec::new();
    for (result, job) in decode_jobs(&jobs).into_iter().zip(&jobs) {
        ids.push(match result {
            Ok((decoded, of_recipe)) => {
                let first = textures.len();
                textures.extend(decoded);
                of_recipe.into_iter().map(|index| index.map(|i| TextureId((first + i) as u32))).collect()
            }
            Err(why) => {
                let message = format!("texture: {why}: the constant is used");
                report.warn(&job.first.file, job.first.line, message);
                vec![None; job.recipes.len()]
            }
        });
    }
    let answer = |(request, (job, recipe)): (&Request<'_>, (usize, usize))| Some(request.map(ids[job][recipe]?));
    let answers = requests.iter().zip(places).map(answer).collect();
    (textures, answers)
}

/// What is to be decoded, and for each request its job and the recipe there.
fn jobs<'a>(requests: &'a [Request<'a>], report: &mut Report) -> (Vec<Job<'a>>, Vec<(usize, usize)>) {
    let mut jobs: Vec<Job<'a>> = Vec::new();
    let mut known: HashMap<(PathBuf, Option<String>), usize> = HashMap::new();
    let mut finder = Finder::default();
    let mut noted = HashSet::new();
    let place = |request: &'a Request<'a>| {
        let (path, note) = request.find(&mut finder);
        if let Some(message) = note.filter(|message| noted.insert(message.clone())) {
            report.warn(&request.file, request.line, message);
        }
        let key = request.key(path.as_deref());
        let index = *known.entry(key).or_insert_with(|| {
            jobs.push(Job { path, first: request, recipes: Vec::new() });
            jobs.len() - 1
        });
        let (recipes, recipe) = (&mut jobs[index].recipes, request.recipe);
        let position = recipes.iter().position(|&known| known == recipe).unwrap_or_else(|| {
            recipes.push(recipe);
            recipes.len() - 1
        });
        (index, position)
    };
    let places = requests.iter().map(place).collect();
    (jobs, places)
}

/// Small images side by side, then large ones one after the other.
fn decode_jobs(jobs: &[Job<'_>]) -> Vec<Result<Decoded, String>> {
    let small: Vec<_> = jobs.par_iter().map(|job| job.decode(&|need| Ok(need <= LARGE)).transpose()).collect();
    // The device gets a copy of all of them later, in the same memory or in its own.
    let mut copies = 0;
    let results = small.into_iter().zip(jobs).map(|(result, job)| {
        let decoded = result.unwrap_or_else(|| {
            let fits = |need| enough_memory(need + copies).map(|()| true);
            job.decode(&fits).and_then(|decoded| decoded.ok_or_else(|| "is too large".to_owned()))
        })?;
        copies += decoded.0.iter().map(|texture| size_of_val(texture.texels()) as u64).sum::<u64>();
        Ok(decoded)
    });
    results.collect()
}

/// Width and height of an image that is neither empty nor too large.
pub(super) fn extent(decoder: &impl ImageDecoder) -> Result<[u32; 2], String> {
    let (width, height) = decoder.dimensions();
    if width == 0 || height == 0 {
        return Err("the image has no pixels".into());
    }
    if width.max(height) > MAX_SIDE {
        return Err(format!("{width} × {height} texels, and {MAX_SIDE} a side are the most"));
    }
    Ok([width, height])
}

/// Says why not, with figures, where there is less.
pub(super) fn enough_memory(need: u64) -> Result<(), String> {
    fits(need, memory::available().unwrap_or(UNKNOWN_MEMORY))
}

fn fits(need: u64, there: u64) -> Result<(), String> {
    let [needed, left] = [need, there].map(memory::figure);
    if need <= there { Ok(()) } else { Err(format!("it needs {needed} of memory and {left} are free")) }
}

impl Job<'_> {
    /// The textures; `None` where `may_take` declines the memory, bytes, that they need.
    fn decode(&self, may_take: &dyn Fn(u64) -> Result<bool, String>) -> Result<Option<Decoded>, String> {
        let Some(path) = &self.path else { return Err(format!("there is no file {:?}", self.first.name())) };
        match &self.first.image {
            ImageAt::Named(_) => {
                let say = |error: std::io::Error| format!("{}: {error}", path.display());
                let file_size = std::fs::metadata(path).map_err(say)?.len();
                // Opening may read the whole file.
                enough_memory(file_size).map_err(|e| format!("{}: {e}", path.display()))?;
                self.read(path, &path.display().to_string(), ImageReader::open(path).map_err(say)?, file_size, may_take)
            }
            ImageAt::Within(name, bytes) => self.read(path, name, ImageReader::new(Cursor::new(bytes)), 0, may_take),
        }
    }

    /// The textures of the image `name`, which is in the file at `path`; `held` is what holding the file takes, bytes.
    fn read<R: BufRead + Seek>(
        &self,
        path: &Path,
        name: &str,
        reader: ImageReader<R>,
        held: u64,
        may_take: &dyn Fn(u64) -> Result<bool, String>,
    ) -> Result<Option<Decoded>, String> {
        let say = |error: &dyn std::fmt::Display| format!("{name}: {error}");
        let mut reader = reader.with_guessed_format().map_err(|e| say(&e))?;
        if reader.format() == Some(ImageFormat::OpenExr) {
            let mut file = reader.into_inner();
            exr_header::check(&mut file).map_err(|e| say(&e))?;
            reader = ImageReader::with_format(file, ImageFormat::OpenExr);
        }
        // What it takes is asked below.
        reader.no_limits();
        let decoder = reader.into_decoder().map_err(|e| say(&e))?;
        let [width, height] = extent(&decoder).map_err(|e| say(&e))?;
        let chain = 4 * mipmap::chain_length(&mipmap::extents(width, height)) as u64;
        let need = held + decoder.total_bytes() + 2 * chain * self.recipes.len() as u64;
        if !may_take(need).map_err(|why| say(&format!("{width} × {height} texels: {why}")))? {
            return Ok(None);
        }
        let image = DynamicImage::from_decoder(decoder).map_err(|e| say(&e))?;
        Ok(Some(texel_source::textures(&path.display().to_string(), image, &self.recipes)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::map_options::Channel;
    use crate::scene::texel_source::Role;

    fn request(name: &str, role: Role, options: MapOptions) -> Request<'static> {
        let image = ImageAt::Named(vec![name.into()]);
        let (recipe, placing) = (Recipe::new(role, &options), Placing::from(&options));
        Request { image, file: "a.mtl".into(), line: Some(1), recipe, placing }
    }

    #[test]
    fn what_does_not_fit_is_told_with_figures() {
        let directory = tempfile::tempdir().expect("a folder");
        let path = directory.path().join("a.png");
        image::RgbImage::new(1024, 512).save(&path).expect("written");
        let request = request("a.png", Role::Colour, MapOptions::default());
        let job = Job { path: Some(path), first: &request, recipes: vec![request.recipe] };
        // 1.5 MiB of RGB, and twice 2 MiB with a third on top for the smaller levels.
        let refused = job.decode(&|need| fits(need, 6 << 20).map(|()| true));
        let Err(why) = refused else { panic!("accepted") };
        assert!(why.contains("1024 × 512 texels: it needs 7 MiB of memory and 6 MiB are free"), "{why}");
        let taken = job.decode(&|need| fits(need, 7 << 20).map(|()| true)).expect("decoded").expect("taken");
        assert_eq!(taken.0[0].extents()[0], [1024, 512]);
        assert!(job.decode(&|_| Ok(false)).expect("no fault").is_none());
    }

    #[test]
    fn options_become_the_map_of_one_texture() {
        let directory = tempfile::tempdir().expect("a folder");
        image::RgbImage::from_pixel(2, 2, image::Rgb([9, 90, 200]))
            .save(directory.path().join("a.png"))
            .expect("written");
        let placed = MapOptions { scale: [4.0, 2.0], offset: [0.5, 0.25], clamp: true, ..MapOptions::default() };
        let red = MapOptions { channel: Some(Channel::R), ..MapOptions::default() };
        let requests: Vec<Request> = [
            (Role::Colour, MapOptions::default()),
            (Role::Colour, placed),
            (Role::Mask, red),
            (Role::CutOut, MapOptions::default()),
        ]
        .into_iter()
        .map(|(role, options)| Request { file: directory.path().join("a.mtl"), ..request("a.png", role, options) })
        .collect();
        let mut report = Report::default();
        let (textures, maps) = decode_all(&requests, &mut report);
        assert_eq!((textures.len(), maps[3], report.faults.len()), (2, None, 0));
        let plain = TextureMap::from(TextureId(0));
        assert_eq!(maps[0], Some(plain));
        let matrix = Mat2::from_diagonal(Vec2::new(4.0, 2.0));
        let expected = TextureMap { matrix, offset: Vec2::new(0.5, 0.25), wrap: [Wrap::Clamp; 2], ..plain };
        assert_eq!(maps[1], Some(expected));
        assert_eq!(textures[1].texels()[0][3], 9, "the red channel");
    }
}
