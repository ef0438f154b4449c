//! What the tests on a device share: the device or a reason to skip, small scenes built by hand, and their light.
#![allow(clippy::unwrap_used, reason = "in a test, a panic is how a failure shows")]

use glam::{Vec2, Vec3};
use penombre::cache::drawn_mesh::DrawnTriangle;
use penombre::cache::ids::{DrawnId, SlotId};
use penombre::error::Error;
use penombre::pass::{Renderer, UpdateMode};
use penombre::refine::update::{Patch, Slot, Update};
use penombre::scene::camera::{Camera, ImageSize, NamedCamera, View};
use penombre::scene::material::{Material, MaterialId};
use penombre::scene::texture::{Texture, TextureId};
use penombre::scene::{FaceId, Scene, TriangleId};
use penombre::vk::{Device, DeviceOptions};
use std::cell::Cell;
use std::sync::Arc;

/// Both update modes.
pub const MODES: [UpdateMode; 2] = [UpdateMode::Stencil, UpdateMode::Id];

/// A device watched by the validation layers; `None`, with one line said, where there is none.
/// `PENOMBRE_REQUIRE_GPU=1` makes a missing device or layer a failure.
pub fn device() -> Option<Arc<Device>> {
    let required = std::env::var("PENOMBRE_REQUIRE_GPU").is_ok_and(|v| v == "1");
    match Device::new(&DeviceOptions { device: None, validation: Some(true) }) {
        Ok(device) => {
            assert!(device.validates() || !required, "the validation layer is not installed");
            Some(device)
        }
        Err(Error::NoDevice(reason)) if !required => {
            println!("skipped: {reason}");
            None
        }
        Err(other) => panic!("{other}"),
    }
}

/// Checks that the layers were silent and that nothing made from the device is left.
pub fn finish(device: Arc<Device>) {
    assert_eq!(device.validation_messages(), Vec::<String>::new());
    assert_eq!(device.live_objects(), Vec::<String>::new());
    assert_eq!(Arc::strong_count(&device), 1);
}

/// Runs a test on a renderer, then checks what `finish` checks.
pub fn with_renderer(test: impl FnOnce(&mut Renderer)) {
    let Some(device) = device() else { return };
    let mut renderer = Renderer::new(Arc::clone(&device), ImageSize { width: 64, height: 48 }).unwrap();
    test(&mut renderer);
    drop(renderer);
    finish(device);
}

/// A scene with the default grey material.
pub fn empty_scene() -> Scene {
    let camera = Camera { position: Vec3::Z * 3.0, look_at: Vec3::ZERO, up: Vec3::Y, vertical_fov: 45.0 };
    Scene {
        materials: vec![Material::grey("grey")],
        cameras: vec![NamedCamera { name: "main".to_owned(), camera }],
        ..Scene::default()
    }
}

/// Adds a triangle; its vertices are not shared.
pub fn add_triangle(scene: &mut Scene, corners: [Vec3; 3], uvs: [Vec2; 3], material: u32) -> TriangleId {
    let first = scene.positions.len() as u32;
    scene.positions.extend(corners);
    scene.triangles.push([first, first + 1, first + 2]);
    let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize();
    scene.normals.push([normal; 3]);
    scene.uvs.push(uvs);
    scene.triangle_materials.push(MaterialId(material));
    TriangleId(scene.triangles.len() as u32 - 1)
}

/// Adds a parallelogram as two triangles, front towards a × b, with texture coordinates from 0 to `repeat`.
pub fn add_quad(scene: &mut Scene, origin: Vec3, a: Vec3, b: Vec3, material: u32, repeat: f32) {
    let corner = |s: f32, t: f32| (origin + a * s + b * t, Vec2::new(s, t) * repeat);
    for [p, q, r] in [[(0.0, 0.0), (1.0, 0.0), (1.0, 1.0)], [(0.0, 0.0), (1.0, 1.0), (0.0, 1.0)]] {
        let [(p, pt), (q, qt), (r, rt)] = [p, q, r].map(|(s, t)| corner(s, t));
        add_triangle(scene, [p, q, r], [pt, qt, rt], material);
    }
}

/// Adds a material, and returns its index.
pub fn add_material(scene: &mut Scene, edit: impl FnOnce(&mut Material)) -> u32 {
    let mut material = Material::grey("made by hand");
    edit(&mut material);
    scene.materials.push(material);
    scene.materials.len() as u32 - 1
}

/// Adds a texture.
pub fn add_texture(scene: &mut Scene, width: u32, height: u32, texel: impl Fn(u32, u32) -> [u8; 4]) -> TextureId {
    let texels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| texel(x, y)).collect();
    scene.textures.push(Texture::new("made by hand".to_owned(), [width, height], texels));
    TextureId(scene.textures.len() as u32 - 1)
}

/// A pseudo-random number in [0, 1) from an index (PCG hash).
pub fn noise(index: u32) -> f32 {
    let state = index.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
    let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
    ((word >> 22) ^ word) as f32 / 4_294_967_296.0
}

/// Many small triangles in all directions, far and near.
pub fn confetti(count: u32) -> Scene {
    let mut scene = empty_scene();
    let vector = |i: u32| Vec3::new(noise(3 * i), noise(3 * i + 1), noise(3 * i + 2)) * 2.0 - 1.0;
    for i in 0..count {
        let centre = vector(4 * i);
        let corners = [1, 2, 3].map(|k| centre + vector(4 * i + k) * 0.25);
        add_triangle(&mut scene, corners, [Vec2::ZERO; 3], 0);
    }
    scene
}

/// A bumpy floor of `2 n²` triangles, textured.
pub fn terrain(n: u32) -> Scene {
    let mut scene = empty_scene();
    let texture = add_texture(&mut scene, 256, 256, |x, y| [(x ^ y) as u8, x as u8, y as u8, 255]);
    let material = add_material(&mut scene, |m| m.map_kd = Some(texture.into()));
    let at = |x: u32, y: u32| {
        let height = noise(x * 7919 + y) * 1.5 / n as f32;
        Vec3::new(x as f32 / n as f32 * 2.0 - 1.0, y as f32 / n as f32 * 2.0 - 1.0, height)
    };
    let uv = |x: u32, y: u32| Vec2::new(x as f32, y as f32) / n as f32 * 4.0;
    for (x, y) in (0..n).flat_map(|y| (0..n).map(move |x| (x, y))) {
        let [a, b, c, d] = [(x, y), (x + 1, y), (x + 1, y + 1), (x, y + 1)];
        for [p, q, r] in [[a, b, c], [a, c, d]] {
            add_triangle(&mut scene, [p, q, r].map(|(x, y)| at(x, y)), [p, q, r].map(|(x, y)| uv(x, y)), material);
        }
    }
    scene
}

/// The scene's first camera on an image.
pub fn view_of(scene: &Scene, width: u32, height: u32) -> View {
    scene.view(&scene.cameras[0].camera, ImageSize { width, height })
}

/// Loads a scene and draws what its first camera sees.
pub fn show(renderer: &mut Renderer, scene: &Scene, width: u32, height: u32) -> Vec<(FaceId, u32)> {
    renderer.load(scene).unwrap();
    renderer.resize(ImageSize { width, height }).unwrap();
    renderer.set_view(&view_of(scene, width, height), Vec2::ZERO);
    renderer.visibility().unwrap()
}

/// An update that draws the given faces as one leaf each (leaf id = face id, slots 3·face …), `light` giving each
/// corner's slot. `drawn` says whether they were drawn before.
pub fn base_update(
    scene: &Scene,
    faces: impl IntoIterator<Item = FaceId>,
    drawn: bool,
    light: impl Fn(FaceId, Vec3) -> Slot,
) -> Update {
    let mut update = Update::default();
    for face in faces {
        let slots = [0, 1, 2].map(|k| SlotId(3 * face.0 + k));
        for (slot, position) in slots.iter().zip(scene.corners(face.triangle())) {
            update.slots.push((*slot, light(face, position)));
        }
        update.drawn_triangles.push((DrawnId(face.0), DrawnTriangle { slots, face, level: 0, flat: None }));
        let start = update.patch_triangles.len() as u32;
        update.patch_triangles.push(DrawnId(face.0));
        let old = if drawn { start..start + 1 } else { start..start };
        update.patches.push(Patch { face, old, new: start..start + 1 });
    }
    update
}

/// Faces of a visible set.
pub fn faces(visible: &[(FaceId, u32)]) -> Vec<FaceId> {
    visible.iter().map(|&(face, _)| face).collect()
}

/// A leaf with its face and level, and corners, each a slot and its position.
type DynamicTriangle = (u32, (FaceId, u8), [(u32, Vec3); 3]);

/// A dynamic mesh that splits its leaves in four at random, and tells the renderer.
pub struct Splitter {
    drawn_triangles: Vec<DynamicTriangle>,
    next_drawn: u32,
    next_slot: u32,
    random: Cell<u32>,
}

impl Splitter {
    pub fn new(scene: &Scene, visible: &[FaceId]) -> Self {
        let drawn = |&face: &FaceId| {
            let corners = scene.corners(face.triangle());
            (face.0, (face, 0), [0, 1, 2].map(|k| (3 * face.0 + k, corners[k as usize])))
        };
        let first_free = 2 * scene.triangles.len() as u32;
        let drawn_triangles = visible.iter().map(drawn).collect();
        Self { drawn_triangles, next_drawn: first_free, next_slot: 3 * first_free, random: Cell::new(7) }
    }

    fn random(&self) -> f32 {
        self.random.set(self.random.get() + 1);
        noise(self.random.get())
    }

    /// Light that jumps from vertex to vertex.
    pub fn slot(&self, position: Vec3) -> Slot {
        let value = Vec3::new(self.random(), self.random(), self.random()) * 4.0;
        Slot { position, weight: 1.0, diffuse: value, specular: value * 0.5, light_vector: glam::Vec4::ZERO }
    }

    /// Splits about a share of the leaves.
    pub fn split(&mut self, share: f32) -> Update {
        let mut update = Update::default();
        for (id, (face, level), corners) in std::mem::take(&mut self.drawn_triangles) {
            if self.random() > share {
                self.drawn_triangles.push((id, (face, level), corners));
                continue;
            }
            let middle = |k: usize| (corners[k].1 + corners[(k + 1) % 3].1) * 0.5;
            let middles = [0, 1, 2].map(|k| (self.next_slot + k, middle(k as usize)));
            self.next_slot += 3;
            update.slots.extend(middles.map(|(slot, p)| (SlotId(slot), self.slot(p))));
            let [a, b, c] = corners;
            let [ab, bc, ca] = middles;
            let old = update.patch_triangles.len() as u32;
            update.patch_triangles.push(DrawnId(id));
            let new = update.patch_triangles.len() as u32;
            for child in [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]] {
                update.drawn_triangles.push((
                    DrawnId(self.next_drawn),
                    DrawnTriangle { slots: child.map(|v| SlotId(v.0)), face, level: level + 1, flat: None },
                ));
                update.patch_triangles.push(DrawnId(self.next_drawn));
                self.drawn_triangles.push((self.next_drawn, (face, level + 1), child));
                self.next_drawn += 1;
            }
            update.patches.push(Patch { face, old: old..old + 1, new: new..new + 4 });
        }
        update
    }

    /// New values at the vertices of about a share of the leaves.
    pub fn change(&self, share: f32) -> Update {
        let mut update = Update::default();
        let mut changed = std::collections::HashSet::new();
        for (_, _, corners) in &self.drawn_triangles {
            if self.random() < share {
                for &(slot, position) in corners {
                    update.slots.push((SlotId(slot), self.slot(position)));
                    changed.insert(slot);
                }
            }
        }
        // A vertex belongs to several leaves: each of them is a patch.
        for (id, (face, _), corners) in &self.drawn_triangles {
            if corners.iter().any(|c| changed.contains(&c.0)) {
                let start = update.patch_triangles.len() as u32;
                update.patch_triangles.push(DrawnId(*id));
                update.patches.push(Patch { face: *face, old: start..start + 1, new: start..start + 1 });
            }
        }
        update
    }
}
