//! Loading a scene: a scene file or a bare OBJ, its materials and textures; every fault with its place.

use super::coplanar::Coplanar;
use super::geometry::Geometry;
use super::input::{self, Kind};
use super::light::Light;
use super::material::{Material, TextureMap};
use super::material_library::MaterialLibrary;
use super::mtl::MAPS;
use super::obj::{self, SKIP, Soup};
use super::obj_text::{Named, ObjText};
use super::report::Report;
use super::scene_file::{self, Description};
use super::subject::Subject;
use super::texture::Texture;
use super::up_axis::UpAxis;
use super::{Scene, camera::NamedCamera, emitters, framing, materials, normals, origin, textures};
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

/// Loads the scene file (`.toml`) or OBJ at `path`.
///
/// # Errors
/// [`Error::Io`] when `path` itself cannot be read; [`Error::Input`] with all faults, warnings included, when anything
/// refuses the scene or nothing is left to draw.
pub fn load(path: &Path) -> Result<Loaded> {
    load_with(path, None)
}

/// Loads the scene file or OBJ at `path`; `up` says which axis of a bare OBJ points up, y if nothing does.
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
    let main = open(path, up)?;
    let (description, mut report) = main.describe(path, DVec3::ZERO);
    let mut timings = Timings::default();
    let parsing = trace::span("parse");
    let (paths, bytes) = read_objs(path, &description, &mut report);
    let (mut files, origin) = parse_objs(&paths, &bytes);
    drop(bytes);
    let description = if origin == DVec3::ZERO { description } else { main.describe(path, origin).0 };
    warn_of_origin(path, origin, &mut report);
    files.iter_mut().for_each(|file| report.faults.append(&mut file.text.report.faults));
    timings.text = start.elapsed();
    drop(parsing);
    let mut library = MaterialLibrary::default();
    let named: Vec<_> = files.iter().map(|file| find_materials(file, &mut library, &mut report)).collect();
    library.settle_opacities(in_use(&files, &named), &mut report);
    let slots: Vec<Slots> =
        files.iter().zip(&named).map(|(file, named)| resolve(file, named, &mut library, &mut report)).collect();
    timings.materials = start.elapsed() - timings.text;
    let (decoded, soup) = rayon::join(|| decode(&library), || assemble(&files, &slots, &library.painted, on_geometry));
    let ((images, ids, image_report), spent) = decoded;
    timings.textures = spent;
    let (soup, spent) = soup;
    timings.geometry = spent;
    let finish = Instant::now();
    let scene_materials = build_materials(&library, &ids, &mut report);
    report.faults.extend(image_report.faults);
    let counts = Counts {
        drawn: soup.triangles.len(),
        zero_area: soup.zero_area,
        see_through: soup.skipped,
        dropped_faces: files.iter().map(|f| f.text.dropped_faces).sum(),
    };
    if counts.drawn == 0 && !files.is_empty() {
        report.error(path, None, nothing_to_draw(&counts));
    }
    if report.has_errors() {
        return Err(Error::Input(report));
    }
    let files = files_read(path, [paths, description.pictures.clone()].concat(), &library, &images);
    let scene = finish_scene(path, (description, origin), soup, scene_materials, images, &mut report);
    timings.finish = finish.elapsed();
    timings.total = start.elapsed();
    Ok(Loaded { scene, report, files, counts, timings })
}

fn files_read(path: &Path, named: Vec<PathBuf>, library: &MaterialLibrary, images: &[Texture]) -> Vec<PathBuf> {
    let images = images.iter().map(|image| PathBuf::from(image.name()));
    let mut files: Vec<PathBuf> = std::iter::once(path.to_owned())
        .chain(named)
        .chain(library.files().map(Path::to_owned))
        .chain(images)
        .collect();
    files.sort_unstable();
    files.dedup();
    files
}

/// The main file.
enum Main {
    /// A scene file's text.
    SceneFile(String),
    /// A bare OBJ, and which of its axes points up.
    Obj(UpAxis),
}

fn open(path: &Path, up: Option<UpAxis>) -> Result<Main> {
    let refuse = |why: String| {
        let mut report = Report::default();
        report.error(path, None, why);
        Error::Input(report)
    };
    let data = std::fs::metadata(path).map_err(|e| Error::io(path, "cannot read", e))?;
    if data.is_dir() {
        return Err(refuse("is a directory: name a scene file or an OBJ in it".into()));
    }
    match input::kind(path).map_err(refuse)? {
        Kind::SceneFile if up.is_some() => {
            let file = path.display();
            Err(Error::Usage(format!("--up is for a bare OBJ: in {file}, up = [x, y, z] of a [[camera]] says it")))
        }
        Kind::SceneFile => {
            let bytes = input::read_scene_file(path).map_err(refuse)?;
            let text = String::from_utf8(bytes).map_err(|_| refuse("is not UTF-8, which TOML has to be".into()))?;
            Ok(Main::SceneFile(text))
        }
        Kind::Obj => {
            // Opening a pipe would wait for its writer; `read_objs` refuses it.
            if data.is_file() {
                std::fs::File::open(path).map_err(|e| Error::io(path, "cannot read", e))?;
            }
            Ok(Main::Obj(up.unwrap_or_default()))
        }
    }
}

impl Main {
    /// What is to be loaded, with `origin` as the origin. A bare OBJ is a scene of one file.
    fn describe(&self, path: &Path, origin: DVec3) -> (Description, Report) {
        match self {
            Self::SceneFile(text) => scene_file::read(path, text, origin),
            Self::Obj(up) => {
                let objs = vec![scene_file::ObjName { path: path.to_owned(), line: None }];
                (Description { objs, up: *up, ..Description::default() }, Report::default())
            }
        }
    }
}

/// An OBJ file.
struct ObjFile {
    path: PathBuf,
    text: ObjText,
    models: Vec<tobj::Model>,
}

impl ObjFile {
    /// Reads a file, positions from `origin`.
    fn parse(path: &Path, bytes: &[u8], origin: DVec3) -> Self {
        let mut text = ObjText::read(path, bytes, origin);
        let models = obj::parse(&text).unwrap_or_else(|error| {
            text.report.error(path, None, format!("cannot be read: {error}"));
            Vec::new()
        });
        Self { path: path.to_owned(), text, models }
    }

    /// Positions that faces use; one that is no number stands for those that cannot be drawn.
    fn positions(&self) -> Vec<Vec3> {
        let positions = self.models.iter().flat_map(|model| model.mesh.positions.chunks_exact(3).map(Vec3::from_slice));
        positions.chain((!self.text.all_usable).then_some(Vec3::NAN)).collect()
    }
}

/// The OBJ files that can be read, with their bytes.
fn read_objs(main: &Path, description: &Description, report: &mut Report) -> (Vec<PathBuf>, Vec<Vec<u8>>) {
    let read = |obj: &scene_file::ObjName| -> Result<Vec<u8>, String> {
        if input::kind(&obj.path)? == Kind::SceneFile {
            return Err("is a scene file: name an OBJ".into());
        }
        input::read_text(&obj.path)
    };
    let results: Vec<_> = description.objs.par_iter().map(read).collect();
    let mut files = (Vec::new(), Vec::new());
    for (result, obj) in results.into_iter().zip(&description.objs) {
        match (result, obj.line) {
            (Ok(bytes), _) => {
                files.0.push(obj.path.clone());
                files.1.push(bytes);
            }
            (Err(why), None) => report.error(main, None, why),
            (Err(why), line) => report.error(main, line, format!("{}: {why}", obj.path.display())),
        }
    }
    files
}

/// The polygons of OBJ files, and the point that becomes the origin: where that is another than theirs, they are read anew.
fn parse_objs(paths: &[PathBuf], bytes: &[Vec<u8>]) -> (Vec<ObjFile>, DVec3) {
    let parse = |origin: DVec3| -> Vec<ObjFile> {
        paths.par_iter().zip(bytes).map(|(path, bytes)| ObjFile::parse(path, bytes, origin)).collect()
    };
    let files = parse(DVec3::ZERO);
    let positions: Vec<Vec<Vec3>> = files.iter().map(ObjFile::positions).collect();
    let origin = if origin::is_here(&positions) { DVec3::ZERO } else { origin::find(bytes) };
    if origin == DVec3::ZERO { (files, origin) } else { (parse(origin), origin) }
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

/// The slots of one OBJ's materials.
struct Slots {
    of_material: Vec<u32>,
    no_material: u32,
}

/// Where the material library has the materials of an OBJ, by their numbers.
fn find_materials(file: &ObjFile, library: &mut MaterialLibrary, report: &mut Report) -> Vec<Option<usize>> {
    let library = library.open_libraries(&file.path, &file.text.libraries, report);
    file.text.materials.iter().map(|named| library.find(&named.name)).collect()
}

/// The materials that faces use.
fn in_use(files: &[ObjFile], named: &[Vec<Option<usize>>]) -> impl Iterator<Item = usize> {
    let has_faces = files.iter().flat_map(|file| &file.text.has_faces);
    has_faces.zip(named.iter().flatten()).filter_map(|(has_faces, index)| index.filter(|_| *has_faces))
}

fn resolve(file: &ObjFile, named: &[Option<usize>], library: &mut MaterialLibrary, report: &mut Report) -> Slots {
    let coloured = file.text.has_colours;
    let stand_in = if coloured { "the vertex colours are" } else { "grey is" };
    let slot = |(named, index): (&Named, &Option<usize>)| match index {
        Some(index) => library.slot(*index, coloured, report),
        None => {
            let message = format!("material {}: in no MTL file: {stand_in} used", named.name);
            report.warn(&file.path, Some(named.line), message);
            library.grey(&named.name, coloured)
        }
    };
    let of_material: Vec<u32> = file.text.materials.iter().zip(named).map(slot).collect();
    // `tobj` names no material only before the first `usemtl`.
    let no_material =
        if starts_without_material(&file.text.faces) { library.grey("no material", coloured) } else { SKIP };
    let is_painted = |&slot: &u32| library.painted.get(slot as usize).is_some_and(|&painted| painted);
    if coloured && !of_material.iter().chain([&no_material]).any(is_painted) {
        let message = "the vertex colours are not used: every material has its own Kd or map_Kd";
        report.warn(&file.path, None, message);
    }
    Slots { of_material, no_material }
}

/// Whether a face stands before the first `usemtl` of the checked text.
fn starts_without_material(faces: &[u8]) -> bool {
    let after_library = memchr::memchr(b'\n', faces).map_or(0, |end| end + 1);
    faces.get(after_library) == Some(&b'f')
}

type Decoded = ((Vec<Texture>, Vec<Option<TextureMap>>, Report), Duration);

fn decode(library: &MaterialLibrary) -> Decoded {
    let _textures = trace::span("textures");
    let start = Instant::now();
    let mut report = Report::default();
    let requests: Vec<_> = library.drawn().flat_map(materials::requests).map(|(_, request)| request).collect();
    let (images, ids) = textures::decode_all(&requests, &mut report);
    ((images, ids, report), start.elapsed())
}

fn assemble(
    files: &[ObjFile],
    slots: &[Slots],
    painted: &[bool],
    on_geometry: impl FnOnce(&Geometry),
) -> (Soup, Duration) {
    let start = Instant::now();
    let mut soup = Soup::default();
    for (file, slots) in files.iter().zip(slots) {
        soup.add(&file.models, &slots.of_material, slots.no_material, painted);
    }
    soup.complete();
    on_geometry(&soup.geometry());
    (soup, start.elapsed())
}

/// The materials of all slots; `ids` answers the requests of the drawn ones, in order.
fn build_materials(library: &MaterialLibrary, ids: &[Option<TextureMap>], report: &mut Report) -> Vec<Material> {
    let mut answers = ids.iter().copied();
    library.materials(|m, painted| {
        let mut maps = [None; MAPS];
        for (map, _) in materials::requests(m) {
            maps[map as usize] = answers.next().flatten();
        }
        materials::build(m, maps, painted, report)
    })
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

fn finish_scene(
    path: &Path,
    (description, origin): (Description, DVec3),
    soup: Soup,
    materials: Vec<Material>,
    textures: Vec<Texture>,
    report: &mut Report,
) -> Scene {
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
        let message = format!("{turned} vertex normals (vn) point to the back of their face and are turned");
        report.warn(path, None, message);
    }
    scene.coplanar = Coplanar::find_with(&scene, &soup.repeats);
    let area_lights = emitters::find(&scene);
    add_lights(&mut scene.lights, area_lights);
    complete_view(path, description.up, &mut scene, report);
    scene
}

/// Edits address lights by name: a name of the scene file or of another MTL may be taken.
fn add_lights(lights: &mut Vec<Light>, more: Vec<Light>) {
    let mut taken: HashSet<String> = lights.iter().map(|light| light.name.clone()).collect();
    for mut light in more {
        while !taken.insert(light.name.clone()) {
            light.name.push_str(" (area)");
        }
        lights.push(light);
    }
}

/// A camera and a light where the scene has none.
fn complete_view(path: &Path, up: UpAxis, scene: &mut Scene, report: &mut Report) {
    if !scene.cameras.is_empty() && !scene.lights.is_empty() {
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
    if scene.lights.is_empty() {
        report.warn(path, None, "no light and nothing emits: one point light was added");
        scene.lights.push(Light { name: "added".into(), kind: framing::light(&subject, up) });
    }
}
