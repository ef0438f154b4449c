//! The glTF files of a scene.

use super::cameras::View;
use super::document::Document;
use super::faults::Faults;
use super::lights::Punctual;
use super::maps::Map;
use super::nodes::{self, Placed};
use super::parts::Parts;
use super::triangles::Instance;
use crate::scene::light::Light;
use crate::scene::material::{Material, TextureMap};
use crate::scene::memory;
use crate::scene::origin::Sample;
use crate::scene::report::Report;
use crate::scene::scene_file::{Description, GeometryName, LightUnits};
use crate::scene::soup::Soup;
use crate::scene::source::Source;
use crate::scene::textures::Request;
use glam::{DAffine3, DVec3};
use rayon::prelude::*;
use std::path::{Path, PathBuf};

/// Most triangles of a file.
const MAX_TRIANGLES: u64 = 1 << 28;
/// Memory that a triangle takes until the scene is complete, bytes, roughly.
const TRIANGLE: u64 = 256;
/// Positions that are looked at to find out where a file lies, about.
const LOOKED_AT: u64 = 1 << 20;

/// The glTF files of a scene.
#[derive(Debug, Default)]
pub(in crate::scene) struct GltfFiles {
    models: Vec<Model>,
    sample: Vec<DVec3>,
    origin: DVec3,
}

/// A file that can be drawn.
#[derive(Debug)]
struct Model {
    document: Document,
    parts: Parts,
    /// Nodes with meshes, and their meshes.
    meshes: Vec<(usize, Placed)>,
    lights: Vec<Punctual>,
    views: Vec<View>,
}

impl GltfFiles {
    /// Reads the files that a scene names; `main` is the file that it is loaded by.
    pub(in crate::scene) fn read(main: &Path, description: &Description, report: &mut Report) -> Self {
        let units = description.light_units;
        let named: Vec<&GeometryName> = description.files.iter().filter(|file| file.is_gltf).collect();
        let read: Vec<_> =
            named.par_iter().map(|file| Document::read(&file.path).map(|d| Model::new(d, units))).collect();
        let mut files = Self::default();
        for (result, name) in read.into_iter().zip(named) {
            match result {
                Ok((model, faults)) => {
                    if !faults.has_errors() {
                        files.models.push(model);
                    }
                    report.faults.extend(faults.finish().faults);
                }
                // Of a file that a scene file names it is said where.
                Err(faults) => faults.faults.into_iter().for_each(|fault| match (name.line, fault.place.line) {
                    (Some(_), None) => name.refuse(main, fault.message, report),
                    _ => report.faults.push(fault),
                }),
            }
        }
        files.sample = files.models.iter().flat_map(Model::sample).collect();
        files
    }

    /// Whether there is none that can be drawn.
    pub(in crate::scene) const fn is_empty(&self) -> bool {
        self.models.is_empty()
    }

    /// Positions in the world, spread over all that there are.
    pub(in crate::scene) fn sample(&self) -> &[DVec3] {
        &self.sample
    }

    /// Makes a point of the files' coordinates the origin.
    pub(in crate::scene) const fn set_origin(&mut self, origin: DVec3) {
        self.origin = origin;
    }

    /// The cameras.
    pub(in crate::scene) fn views(&self) -> Vec<View> {
        self.models.iter().flat_map(|model| &model.views).map(|view| view.from(self.origin)).collect()
    }

    /// The lights.
    pub(in crate::scene) fn lights(&self) -> Vec<Light> {
        let lights = self.models.iter().flat_map(|model| &model.lights);
        lights.zip(1..).map(|(light, number)| light.light(self.origin, number)).collect()
    }

    /// The textures of all files, each with the file.
    fn maps(&self) -> impl Iterator<Item = (&Document, &Map)> {
        self.models.iter().flat_map(|model| {
            model.parts.drawn().flat_map(|surface| surface.maps()).map(move |map| (&model.document, map))
        })
    }
}

impl Source for GltfFiles {
    fn slots(&self) -> usize {
        self.models.iter().map(|model| model.parts.slots()).sum()
    }

    fn requests(&self) -> Vec<Request<'_>> {
        self.maps().map(|(document, map)| map.request(document)).collect()
    }

    fn add_to(&self, soup: &mut Soup, mut first: u32, report: &mut Report) {
        for model in &self.models {
            let mut faults = Faults::new(&model.document.path);
            model.add_to(soup, (first, self.origin), &mut faults);
            report.faults.extend(faults.finish().faults);
            first += model.parts.slots() as u32;
        }
    }

    fn materials(&self, maps: &mut dyn Iterator<Item = Option<TextureMap>>, _: &mut Report) -> Vec<Material> {
        self.models.iter().flat_map(|model| model.parts.drawn()).map(|surface| surface.build(maps)).collect()
    }

    fn files(&self) -> Vec<PathBuf> {
        let named = |model: &Model| std::iter::once(model.document.path.clone()).chain(model.document.files.clone());
        self.models.iter().flat_map(named).collect()
    }
}

impl Model {
    /// Looks at all that the scene of a file holds, and says what is wrong with it.
    fn new(document: Document, units: LightUnits) -> (Self, Faults) {
        let mut faults = Faults::new(&document.path);
        let placed = nodes::placed(&document, &mut faults);
        let mut model =
            Self { document, parts: Parts::default(), meshes: Vec::new(), lights: Vec::new(), views: Vec::new() };
        let Self { document, parts, meshes, lights, views } = &mut model;
        for placed in &placed {
            let node = &document.root.nodes[placed.node];
            if let Some(mesh) = node.mesh {
                parts.read(document, mesh.value(), &mut faults);
                meshes.push((mesh.value(), *placed));
            }
            if node.skin.is_some() && node.mesh.is_some() {
                faults.once("skins", "skins are not supported: meshes are drawn as they are without bones");
            }
            if document.names.nodes.get(placed.node).is_some_and(|names| names.has("EXT_mesh_gpu_instancing")) {
                faults
                    .once("instancing", "EXT_mesh_gpu_instancing is not supported: one instance of each mesh is drawn");
            }
            lights.extend(Punctual::of(document, placed, units, &mut faults));
            views.extend(View::of(document, placed, views.len() + 1, &mut faults));
        }
        model.document.warn_of_buffers(&mut faults);
        model.check_size(&mut faults);
        (model, faults)
    }

    /// Instances multiply what a file holds: said before anything of it is made.
    fn check_size(&self, faults: &mut Faults) {
        let of_mesh = |mesh: usize| {
            let twice = |part: &super::parts::Part| 1 + u64::from(self.parts.surfaces[part.surface].twice);
            let parts = self.parts.of(mesh).iter();
            parts.fold(0_u64, |sum, part| sum.saturating_add(part.triangles.saturating_mul(twice(part))))
        };
        let count = self.meshes.iter().fold(0_u64, |sum, (mesh, _)| sum.saturating_add(of_mesh(*mesh)));
        let need = count.saturating_mul(TRIANGLE);
        if count > MAX_TRIANGLES {
            let message = format!(
                "its meshes, each as often as nodes show it, have {count} triangles, and {MAX_TRIANGLES} are the most"
            );
            faults.error("size", message);
        } else if let Some(there) = memory::available().filter(|&there| need > there) {
            let [need, there] = [need, there].map(memory::figure);
            faults.error("size", format!("its {count} triangles need {need} of memory and {there} are free"));
        }
    }

    fn sample(&self) -> Vec<DVec3> {
        let readers = |mesh: usize| self.parts.of(mesh).iter().map(|part| &self.parts.readers[part.positions]);
        let all: u64 = self.meshes.iter().flat_map(|(mesh, _)| readers(*mesh)).map(|reader| reader.count).sum();
        let step = all.div_ceil(LOOKED_AT).max(1);
        let mut sample = Sample::default();
        for (mesh, placed) in &self.meshes {
            for reader in readers(*mesh) {
                for vertex in (0..reader.count.min(u32::MAX.into())).step_by(step as usize) {
                    let position = || reader.vec3(&self.document, vertex as u32).as_dvec3();
                    sample.offer(|| Some(placed.frame.transform_point3(position())));
                }
            }
        }
        sample.found
    }

    fn add_to(&self, soup: &mut Soup, (first, origin): (u32, DVec3), faults: &mut Faults) {
        for (mesh, placed) in &self.meshes {
            let frame = DAffine3 { translation: placed.frame.translation - origin, ..placed.frame };
            for part in self.parts.of(*mesh) {
                let dropped = Instance::new(&self.document, &self.parts, part, frame).add_to(soup, first);
                if dropped > 0 {
                    let [mesh, primitive] = part.place;
                    let message = format!(
                        "mesh {mesh} primitive {primitive} at node {}: {dropped} triangles have a corner that is no vertex, or \
                         whose place is not made of numbers: they are left out",
                        placed.node
                    );
                    faults.warn("triangles", message);
                }
            }
        }
    }
}
