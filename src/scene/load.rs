//! Loading a scene: a scene file, a bare OBJ or glTF, its materials and textures; every fault with its place.

use super::coplanar::Coplanar;
use super::geometry::{Geometry, bounds};
use super::gltf::{GltfFiles, View, are_dim};
use super::input::{self, Kind};
use super::light::Light;
use super::material::{Material, TextureMap};
use super::obj_files::ObjFiles;
use super::report::Report;
use super::scene_file::{Description, GeometryName};
use super::soup::Soup;
use super::source::Source;
use super::subject::Subject;
use super::texture::Texture;
use super::up_axis::UpAxis;
use super::{Scene, camera::NamedCamera, dark_emission, emitters, framing, main_file, normals, origin, textures};
use crate::error::{Error, Result};
use crate::trace;
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// A loaded scene, and what is to be said about it.
#[derive(Debug)]
pub struct Loaded {
    /// The scene.
    pub scene: Scene,
    /// Warnings.
    pub report: Report,
    /// Every file that was read.
    pub files: Vec<PathBuf>,
    /// What became of the triangles.
    pub counts: Counts,
    /// Where the time went.
    pub timings: Timings,
}

/// Triangles by their fate; n corners of a face count as n − 2 triangles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// In the scene.
    pub drawn: usize,
    /// Left out, without area.
    pub zero_area: usize,
    /// Left out, of materials that let light pass (glass).
    pub see_through: usize,
    /// Faces (not triangles) with faults that were dropped.
    pub dropped_faces: usize,
}

impl Counts {
    /// Triangles of all sound faces.
    #[must_use]
    pub const fn kept(&self) -> usize {
        self.drawn + self.zero_area + self.see_through
    }
}

/// Wall time of the stages; textures and geometry run side by side.
#[derive(Clone, Copy, Debug, Default)]
pub struct Timings {
    /// Reading the files, checking their text and parsing it.
    pub text: Duration,
    /// MTL files.
    pub materials: Duration,
    /// Decoding textures.
    pub textures: Duration,
    /// Welding, cutting polygons.
    pub geometry: Duration,
    /// Normals, lights, cameras.
    pub finish: Duration,
    /// All.
    pub total: Duration,
}

/// Loads the scene file (`.toml`), OBJ or glTF at `path`.
///
/// # Errors
/// [`Error::Io`] when `path` itself cannot be read; [`Error::Input`] with all faults, warnings included, when anything
/// refuses the scene or nothing is left to draw.
pub fn load(path: &Path) -> Result<Loaded> {
    load_with(path, None)
}

/// Loads the scene file, OBJ or glTF at `path`; `up` says which axis of a bare OBJ points up, y if nothing does.
///
/// # Errors
/// Those of [`load`]; [`Error::Usage`] where a scene file comes with `up`.
pub fn load_with(path: &Path, up: Option<UpAxis>) -> Result<Loaded> {
    load_beside(path, up, |_| {})
}

/// Loads as [`load_with`], and hands out where the triangles are as soon as that is known: what needs no more can be made beside the
/// rest of the loading. The scene may be refused nevertheless.
///
/// # Errors
/// Those of [`load_with`].
pub fn load_beside(path: &Path, up: Option<UpAxis>, on_geometry: impl FnOnce(&Geometry) + Send) -> Result<Loaded> {
    let _load = trace::span("load");
    let start = Instant::now();
    let main = main_file::open(path, up)?;
    let (description, mut report) = main.describe(path, DVec3::ZERO);
    let mut timings = Timings::default();
    let parsing = trace::span("parse");
    let (paths, bytes) = read_objs(path, &description, &mut report);
    let mut models = GltfFiles::read(path, &description, &mut report);
    let (mut objs, origin) = parse_objs(&paths, &bytes, models.sample());
    drop(bytes);
    let description = if origin == DVec3::ZERO { description } else { main.describe(path, origin).0 };
    models.set_origin(origin);
    warn_of_origin(path, origin, &mut report);
    objs.report_text(&mut report);
    timings.text = start.elapsed();
    drop(parsing);
    objs.read_materials(&mut report);
    timings.materials = start.elapsed() - timings.text;
    let sources: [&dyn Source; 2] = [&objs, &models];
    let (decoded, assembled) = rayon::join(|| decode(&sources), || assemble(&sources, on_geometry));
    let ((images, maps, image_report), spent) = decoded;
    timings.textures = spent;
    let ((soup, soup_report), spent) = assembled;
    timings.geometry = spent;
    let finish = Instant::now();
    report.faults.extend(soup_report.faults);
    let mut maps = maps.into_iter();
    let materials = sources.iter().flat_map(|source| source.materials(&mut maps, &mut report)).collect();
    report.faults.extend(image_report.faults);
    let Soup { zero_area, skipped: see_through, dropped_faces, .. } = soup;
    let counts = Counts { drawn: soup.triangles.len(), zero_area, see_through, dropped_faces };
    if counts.drawn == 0 && !(objs.is_empty() && models.is_empty()) {
        report.error(path, None, nothing_to_draw(&counts));
    }
    if report.has_errors() {
        return Err(Error::Input(report));
    }
    let files = files_read(path, &sources, &description.pictures, &images);
    let first_of_gltf = objs.slots();
    let parts =
        Parts { first_of_gltf, soup, materials, textures: images, views: models.views(), lights: models.lights() };
    let scene = finish_scene(path, (description, origin), parts, &mut report);
    timings.finish = finish.elapsed();
    timings.total = start.elapsed();
    Ok(Loaded { scene, report, files, counts, timings })
}

fn files_read(path: &Path, sources: &[&dyn Source], named: &[PathBuf], images: &[Texture]) -> Vec<PathBuf> {
    let images = images.iter().map(|image| PathBuf::from(image.name()));
    let named = sources.iter().flat_map(|s| s.files()).chain(named.iter().cloned());
    let mut files: Vec<PathBuf> = std::iter::once(path.to_owned()).chain(named).chain(images).collect();
    files.sort_unstable();
    files.dedup();
    files
}

/// The OBJ files that can be read, with their bytes.
fn read_objs(main: &Path, description: &Description, report: &mut Report) -> (Vec<PathBuf>, Vec<Vec<u8>>) {
    let objs: Vec<&GeometryName> = description.files.iter().filter(|file| !file.is_gltf).collect();
    let read = |obj: &&GeometryName| -> Result<Vec<u8>, String> {
        match input::kind(&obj.path)? {
            Kind::SceneFile => Err("is a scene file: name an OBJ".into()),
            Kind::Gltf => Err("is glTF: name it in gltf = [...]".into()),
            Kind::Obj => input::read_text(&obj.path),
        }
    };
    let results: Vec<_> = objs.par_iter().map(read).collect();
    let mut files = (Vec::new(), Vec::new());
    for (result, obj) in results.into_iter().zip(objs) {
        match result {
            Ok(bytes) => {
                files.0.push(obj.path.clone());
                files.1.push(bytes);
            }
            Err(why) => obj.refuse(main, why, report),
        }
    }
    files
}

/// The polygons of OBJ files, and the point that becomes the origin: where that is another than theirs, they are read anew.
/// `others` are positions of other files.
fn parse_objs(paths: &[PathBuf], bytes: &[Vec<u8>], others: &[DVec3]) -> (ObjFiles, DVec3) {
    let files = ObjFiles::parse(paths, bytes, DVec3::ZERO);
    let here = origin::is_here(&files.positions(), others);
    let origin = if here { DVec3::ZERO } else { origin::find(bytes, others) };
    let files = if origin == DVec3::ZERO { files } else { ObjFiles::parse(paths, bytes, origin) };
    (files, origin)
}

/// Where the scene is moved from, said once.
fn warn_of_origin(path: &Path, origin: DVec3, report: &mut Report) {
    if origin != DVec3::ZERO {
        let message = format!(
            "it lies far from the origin, where single precision is too coarse: it is moved so that {} is the origin (cameras, \
             lights and camera paths stay in its own coordinates)",
            readable(origin)
        );
        report.warn(path, None, message);
    }
}

fn readable(point: DVec3) -> String {
    format!("[{}, {}, {}]", point.x, point.y, point.z)
}

type Decoded = ((Vec<Texture>, Vec<Option<TextureMap>>, Report), Duration);

fn decode(sources: &[&dyn Source]) -> Decoded {
    let _textures = trace::span("textures");
    let start = Instant::now();
    let mut report = Report::default();
    let requests: Vec<_> = sources.iter().flat_map(|source| source.requests()).collect();
    let (images, maps) = textures::decode_all(&requests, &mut report);
    ((images, maps, report), start.elapsed())
}

fn assemble(sources: &[&dyn Source], on_geometry: impl FnOnce(&Geometry)) -> ((Soup, Report), Duration) {
    let start = Instant::now();
    let (mut soup, mut report) = (Soup::default(), Report::default());
    let mut first = 0;
    for source in sources {
        source.add_to(&mut soup, first, &mut report);
        first += source.slots() as u32;
    }
    soup.complete();
    on_geometry(&soup.geometry());
    ((soup, report), start.elapsed())
}

fn nothing_to_draw(counts: &Counts) -> String {
    let found: Vec<String> = [
        ("faces with faults", counts.dropped_faces),
        ("triangles without area", counts.zero_area),
        ("triangles of glass, which is not drawn yet", counts.see_through),
    ]
    .into_iter()
    .filter(|&(_, count)| count > 0)
    .map(|(what, count)| format!("{what}: {count}"))
    .collect();
    if found.is_empty() {
        return "nothing to draw: there is no face of three corners or more".into();
    }
    format!("nothing to draw ({})", found.join(", "))
}

fn finish_scene(path: &Path, (description, origin): (Description, DVec3), parts: Parts, report: &mut Report) -> Scene {
    let Parts { first_of_gltf, soup, materials, textures, views, lights } = parts;
    let mut scene = Scene {
        positions: soup.positions,
        triangles: soup.triangles,
        normals: soup.normals,
        uvs: soup.uvs,
        colours: soup.colours,
        triangle_materials: soup.slots,
        materials,
        textures,
        emission_side: description.emission_side,
        lights: description.lights,
        cameras: description.cameras,
        display: description.display,
        origin,
        coplanar: Coplanar::default(),
    };
    let turned = normals::complete(&scene.positions, &scene.triangles, &mut scene.normals, description.smooth_angle);
    if turned > 0 {
        let message = format!("{turned} vertex normals point to the back of their face and are turned");
        report.warn(path, None, message);
    }
    dark_emission::leave_out(&mut scene, first_of_gltf);
    scene.coplanar = Coplanar::find_with(&scene, &soup.repeats);
    let area_lights = emitters::find(&scene);
    let middle = bounds(&scene.positions, &scene.triangles).map_or(Vec3::ZERO, |(lo, hi)| lo.midpoint(hi));
    let alone = area_lights.is_empty() && scene.lights.is_empty();
    if let Some(message) = are_dim(&lights, middle).filter(|_| alone) {
        report.warn(path, None, message);
    }
    add_lights(&mut scene.lights, lights, " (glTF)");
    add_lights(&mut scene.lights, area_lights, " (area)");
    add_cameras(&mut scene, views, middle);
    // A bare model with a glowing detail is not meant to be seen by that alone.
    let is_bare_gltf = description.files.iter().all(|file| file.is_gltf && file.line.is_none());
    let has_others = scene.lights.iter().any(|light| light.kind.is_delta());
    let is_dark = scene.lights.is_empty() || is_bare_gltf && !has_others && dark_emission::is_faint(&scene);
    complete_view(path, (description.up, is_dark), &mut scene, report);
    scene
}

/// What a scene is made of, besides what its scene file says.
struct Parts {
    /// Number of the first material of a glTF file.
    first_of_gltf: usize,
    soup: Soup,
    materials: Vec<Material>,
    textures: Vec<Texture>,
    views: Vec<View>,
    lights: Vec<Light>,
}

/// Edits address lights by name: one that is taken, by the scene file or another file, goes on with `suffix`.
fn add_lights(lights: &mut Vec<Light>, more: Vec<Light>, suffix: &str) {
    let mut taken: HashSet<String> = lights.iter().map(|light| light.name.clone()).collect();
    for mut light in more {
        while !taken.insert(light.name.clone()) {
            light.name.push_str(suffix);
        }
        lights.push(light);
    }
}

/// The cameras of glTF files, after those of the scene file; they look at points as far away as the middle of the scene.
fn add_cameras(scene: &mut Scene, views: Vec<View>, middle: Vec3) {
    let mut taken: HashSet<String> = scene.cameras.iter().map(|camera| camera.name.clone()).collect();
    for view in views {
        let mut name = view.name.clone();
        while !taken.insert(name.clone()) {
            name.push_str(" (glTF)");
        }
        scene.cameras.push(NamedCamera { name, camera: view.towards(middle) });
    }
}

/// A camera and a light where the scene has none.
fn complete_view(path: &Path, (up, is_dark): (UpAxis, bool), scene: &mut Scene, report: &mut Report) {
    if !scene.cameras.is_empty() && !is_dark {
        return;
    }
    let Some(subject) = Subject::of(scene, up) else { return };
    if scene.cameras.is_empty() {
        let camera = framing::camera(&subject, up);
        let from = readable(camera.position.as_dvec3() + scene.origin);
        let message = match subject.left_out() {
            Some(left_out) => format!("no camera: framed from {from}; {left_out}"),
            None => format!("no camera: framed the whole scene from {from}"),
        };
        report.warn(path, None, message);
        scene.cameras.push(NamedCamera { name: "framed".into(), camera });
    }
    if is_dark {
        let found = if scene.lights.is_empty() { "nothing emits" } else { "what emits is a detail" };
        report.warn(path, None, format!("no light and {found}: one point light was added"));
        scene.lights.push(Light { name: "added".into(), kind: framing::light(&subject, up) });
    }
}
