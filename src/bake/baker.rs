//! The run of a bake: an engine that steps by itself, with all faces in view by their area instead of by their pixels.

use super::drawn::{Drawn, Places};
use super::fill::SlotLight;
use super::lit_mesh::{LitMesh, Source};
use super::reached::reached;
use super::texels;
use crate::error::{Error, Result};
use crate::geom::bvh::Bvh;
use crate::refine::engine::{Budget, Counted, Engine, Visible};
use crate::refine::options::Options;
use crate::refine::replay::HostMesh;
use crate::refine::update::{EngineStats, Shown, Slot, SlotId, Update};
use crate::refine::workers::Workers;
use crate::scene::Scene;
use crate::scene::light::Light;
use crate::scene::material::MaterialId;
use glam::Vec3;
use std::sync::Arc;

/// Whose triangles the mesh has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Triangles {
    /// The scene's.
    Base,
    /// Those of the hierarchy, which follow the edges of shadows; without T-junctions.
    #[default]
    Adapted,
}

/// Which sides of triangles the mesh has, each as triangles of its own.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sides {
    /// Those that light reaches; the front where it reaches neither.
    #[default]
    Lit,
    /// The counter-clockwise side.
    Front,
    /// Both.
    Both,
}

impl Triangles {
    /// All choices with the names that options use.
    pub const NAMES: [(&'static str, Self); 2] = [("adapted", Self::Adapted), ("base", Self::Base)];
}

impl Sides {
    /// All choices with the names that options use.
    pub const NAMES: [(&'static str, Self); 3] = [("lit", Self::Lit), ("front", Self::Front), ("both", Self::Both)];
}

/// What is baked.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Plan {
    /// Whose triangles.
    pub triangles: Triangles,
    /// Of which sides.
    pub sides: Sides,
    /// Side of a texel, what counts as a pixel, scene units; `None` goes by the scene's area.
    pub texel: Option<f32>,
    /// Whether each light is kept by itself, too.
    pub per_light: bool,
}

/// Names of lights at most that are kept each by itself: a vertex takes 12 bytes for each.
pub const MAX_LIGHTS: usize = 256;

impl Plan {
    /// Side of a texel, scene units.
    #[must_use]
    pub fn texel_side(&self, scene: &Scene) -> f64 {
        self.texel.map_or_else(|| texels::default_side(scene), f64::from)
    }

    /// Options of the engine, from those of a picture that sees shadows of `shadow_pixels`.
    #[must_use]
    pub fn engine_options(&self, scene: &Scene, picture: Options, shadow_pixels: Option<f32>) -> Options {
        let side = self.texel_side(scene) as f32;
        Options {
            // No image, no display.
            listed: false,
            white: f32::INFINITY,
            shadow_pixels: f32::INFINITY,
            shadow_size: shadow_pixels.map_or(picture.shadow_size, |pixels| pixels * side),
            min_pixels: if self.triangles == Triangles::Base { f32::INFINITY } else { picture.min_pixels },
            // Lights that share a group cannot be told apart.
            max_light_groups: if self.per_light { scene.lights.len().max(1) } else { picture.max_light_groups },
            ..picture
        }
    }

    /// Checks that not too many lights are to be kept.
    ///
    /// # Errors
    /// [`Error::Usage`] if they are.
    pub fn check(&self, scene: &Scene) -> Result<()> {
        let names = first_of_names(&scene.lights).len();
        if !self.per_light || names <= MAX_LIGHTS {
            return Ok(());
        }
        Err(Error::Usage(format!(
            "--per-light: the scene has {names} lights of different names, of which a vertex holds at most {MAX_LIGHTS}; give lights \
             that belong together one name, or leave the option out"
        )))
    }
}

/// The first light of each name, by its number.
fn first_of_names(lights: &[Light]) -> Vec<u32> {
    let mut names = rustc_hash::FxHashSet::default();
    (0..).zip(lights).filter(|(_, light)| names.insert(&light.name)).map(|(index, _)| index).collect()
}

/// An engine at work on all faces.
pub struct Baker {
    scene: Arc<Scene>,
    engine: Engine,
    mesh: HostMesh,
    plan: Plan,
    indirect: bool,
}

impl Baker {
    /// Shows an engine all faces of the sides that are wanted.
    ///
    /// # Errors
    /// [`Error::Internal`] for a fault of the engine.
    pub fn new(scene: Arc<Scene>, bvh: Arc<Bvh>, workers: Workers, options: Options, plan: Plan) -> Result<Self> {
        let wanted = wanted(&scene, &bvh, plan.sides, options.seed);
        let engine = Engine::new(Arc::clone(&scene), bvh, workers, options).without_highlights();
        let faces = texels::faces(&scene, &wanted, plan.texel_side(&scene));
        let mut baker = Self { scene, engine, mesh: HostMesh::default(), plan, indirect: options.indirect };
        // Nobody sees what S is for an eye; there must be one.
        let visible = Visible { generation: 1, eye: Vec3::ZERO, image: None, faces };
        let update = baker.engine.set_visible(&visible);
        baker.take(&update)?;
        Ok(baker)
    }

    /// Does some work.
    ///
    /// # Errors
    /// [`Error::Internal`] for a fault of the engine.
    pub fn step(&mut self, budget: Budget) -> Result<EngineStats> {
        let update = self.engine.step(budget);
        self.take(&update)?;
        Ok(update.stats)
    }

    fn take(&mut self, update: &Update) -> Result<()> {
        self.mesh.apply(update)?;
        let &Update { generation, sequence, .. } = update;
        self.engine.counted(&Counted { generation, sequence, pixels: Vec::new() });
        Ok(())
    }

    /// The mesh as it is lit now.
    ///
    /// # Errors
    /// [`Error::Internal`] for a fault of the engine.
    pub fn lit_mesh(&mut self) -> Result<LitMesh> {
        let update = self.engine.settle();
        self.take(&update)?;
        let (light, names) = self.light();
        let drawn = self.mesh.drawn().map(|(_, triangle, _)| Drawn {
            face: triangle.face,
            level: triangle.level,
            slots: triangle.slots.map(|slot| slot.0),
        });
        let mut places = Places::new(light.weights.len());
        for (slot, value) in self.mesh.slots() {
            places.set(slot.0, value.position, self.engine.cache().slots[slot].normal());
        }
        let source = Source { scene: &self.scene, drawn: drawn.collect(), places };
        Ok(LitMesh::new(source, light, names))
    }

    /// Light by slot: all of it, and if that is wanted of each name of a light and of what bounces; with the names.
    fn light(&mut self) -> (SlotLight, Vec<Option<String>>) {
        let count = self.mesh.free_ids().0.0 as usize;
        let mut light = SlotLight { weights: vec![0.0; count], layers: Vec::new() };
        self.mesh.slots().for_each(|(slot, value)| light.weights[slot.0 as usize] = value.weight);
        light.layers.push(layer(count, self.mesh.slots()));
        let mut names = Vec::new();
        if self.plan.per_light {
            for index in first_of_names(&self.scene.lights) {
                names.push(Some(self.scene.lights[index as usize].name.clone()));
                let update = self.engine.show(Shown::Direct(index));
                light.layers.push(layer(count, update.slots));
            }
            if self.indirect {
                names.push(None);
                let update = self.engine.show(Shown::Indirect);
                light.layers.push(layer(count, update.slots));
            }
            self.engine.show(Shown::Light);
        }
        (light, names)
    }
}

/// By face, whether it is a part of the mesh.
fn wanted(scene: &Scene, bvh: &Bvh, sides: Sides, seed: u64) -> Vec<bool> {
    let is_first = firsts(scene);
    let mut wanted = match sides {
        Sides::Both => vec![true; scene.triangles.len() * 2],
        Sides::Front => vec![false; scene.triangles.len() * 2],
        Sides::Lit => reached(scene, bvh, &is_first, seed),
    };
    wanted.as_chunks_mut::<2>().0.iter_mut().for_each(|[front, back]| *front |= !*back);
    for (sides, is_first) in wanted.as_chunks_mut::<2>().0.iter_mut().zip(is_first) {
        if !is_first {
            *sides = [false; 2];
        }
    }
    wanted
}

/// By triangle, whether it is the first in its place that faces one way and has one material: one will do.
fn firsts(scene: &Scene) -> Vec<bool> {
    let mut places = rustc_hash::FxHashSet::default();
    let mut is_first = |(corners, material): (&[u32; 3], &MaterialId)| {
        let mut corners = *corners;
        let least = (0..3).min_by_key(|&i| corners[i]).unwrap_or(0);
        corners.rotate_left(least);
        places.insert((corners, material.0))
    };
    scene.triangles.iter().zip(&scene.triangle_materials).map(&mut is_first).collect()
}

/// D by slot, W·sr⁻¹·m⁻².
fn layer(count: usize, slots: impl IntoIterator<Item = (SlotId, Slot)>) -> Vec<Vec3> {
    let mut layer = vec![Vec3::ZERO; count];
    for (slot, value) in slots.into_iter().filter(|(slot, _)| (slot.0 as usize) < count) {
        layer[slot.0 as usize] = value.diffuse;
    }
    layer
}
