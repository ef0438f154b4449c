//! A miniature run of every pass: it makes the driver compile all variants of the shaders (at the first draw, 25 to
//! 68 ms each without a disk cache, docs/lavapipe.md) and finds out whether the stencil mode can be trusted.

use super::frame::FrameOptions;
use super::options::RendererOptions;
use super::renderer::Renderer;
use super::update::UpdateMode;
use crate::error::Result;
use crate::refine::update::{DrawnId, DrawnTriangle, Patch, Slot, SlotId, Update};
use crate::scene::camera::{Camera, ImageSize};
use crate::scene::material::{Material, MaterialId};
use crate::scene::texture::{Texture, TextureId};
use crate::scene::{Display, FaceId, Scene};
use crate::vk::Device;
use glam::{Vec2, Vec3};
use std::sync::Arc;

/// Triangles of the miniature: enough for depths of all slopes to be compared.
const TRIANGLES: u32 = 48;

/// The size of the miniature that stands for frames of `size`. llvmpipe compiles shaders anew for images whose sides
/// are powers of two where those before were not, or the other way round: each side must be of the same sort.
fn miniature_size(size: ImageSize) -> ImageSize {
    let side = |pixels: u32| if pixels.is_power_of_two() { 64 } else { 60 };
    ImageSize { width: side(size.width), height: side(size.height) }
}

impl Renderer {
    /// Compiles the pipelines and draws a miniature with each, so that no frame waits for the driver's compiler and the
    /// stencil mode is known to work. Needs no scene: it can run while one loads. `size` is that of the frames to come
    /// ([`Self::resize`] still makes their images).
    ///
    /// # Errors
    /// [`crate::error::Error::Exhausted`] when memory runs out.
    pub fn new(device: Arc<Device>, size: ImageSize) -> Result<Self> {
        let options = RendererOptions::new(&device)?;
        Self::with_options(device, size, options)
    }

    /// As [`Self::new`], made for what the options say.
    ///
    /// # Errors
    /// Also as [`RendererOptions::check`].
    pub fn with_options(device: Arc<Device>, size: ImageSize, options: RendererOptions) -> Result<Self> {
        options.check(&device)?;
        let mut renderer = Self::cold(device, miniature_size(size), options)?;
        renderer.warm_up()?;
        Ok(renderer)
    }

    /// Runs every pass in every mode of the options; sets whether patches drawn through the stencil cover what a full draw
    /// covered.
    fn warm_up(&mut self) -> Result<()> {
        let scene = miniature();
        let size = self.targets.size;
        self.load(&scene)?;
        self.set_view(&scene.view(&scene.cameras[0].camera, size), Vec2::ZERO);
        self.visibility()?; // without occluders, then with those that it found
        let visible: Vec<FaceId> = self.visibility()?.iter().map(|&(face, _)| face).collect();
        let (combine, update_mode) = (Some(Display::default()), UpdateMode::Full);
        let full = FrameOptions { full_luminance: true, colour: true, combine, update_mode, queries: 0 };

        self.apply(&drawn_triangles(&scene, &visible, None, 0))?;
        self.frame(&full)?;
        for mode in self.options.modes.clone() {
            self.warm_up_mode(&scene, &visible, mode)?;
        }
        self.read_display()?;
        self.load(&Scene::default())
    }

    /// Drawn triangles, the same with other values, then others in their place, and one that was never drawn.
    fn warm_up_mode(&mut self, scene: &Scene, visible: &[FaceId], update_mode: UpdateMode) -> Result<()> {
        let patches = FrameOptions { update_mode, ..FrameOptions::default() };
        self.reset_drawn();
        self.apply(&drawn_triangles(scene, visible, None, 0))?;
        self.frame(&FrameOptions { full_luminance: true, ..patches })?;
        self.apply(&drawn_triangles(scene, visible, Some(0), 0))?;
        self.frame(&patches)?;
        self.apply(&drawn_triangles(scene, visible, Some(0), 1))?;
        self.frame(&patches)?;
        if update_mode.needs_stencil() {
            let layers = self.read_layers()?;
            self.stencil_works &= self.find_missed(&layers.d) == 0;
        }
        self.apply(&drawn_triangles(scene, &visible[..visible.len().min(1)], None, 2))?;
        self.frame(&patches).map(|_| ())
    }

    /// Pixels that the full draw wrote and the patches of generation 1 did not.
    fn find_missed(&self, d: &[[f32; 3]]) -> usize {
        d.iter().filter(|d| d[0] > 0.0 && (d[0] - brightness(1)).abs() > 1e-3).count()
    }
}

/// D that drawn triangles of a generation carry.
fn brightness(generation: u32) -> f32 {
    1.0 + generation as f32
}

/// Drawn triangles of `generation` over whole faces, in place of those of `old` or of none.
fn drawn_triangles(scene: &Scene, faces: &[FaceId], old: Option<u32>, generation: u32) -> Update {
    let mut update = Update::default();
    let id = |generation: u32, face: FaceId| generation * 2 * TRIANGLES + face.0;
    for &face in faces {
        let new = id(generation, face);
        let slots = [0, 1, 2].map(|corner| SlotId(3 * new + corner));
        let diffuse = Vec3::splat(brightness(generation));
        for (slot, position) in slots.iter().zip(scene.corners(face.triangle())) {
            update.slots.push((
                *slot,
                Slot { position, weight: 1.0, diffuse, specular: diffuse, light_vector: glam::Vec4::ZERO },
            ));
        }
        update.drawn_triangles.push((DrawnId(new), DrawnTriangle { slots, face, level: 0, flat: None }));
        let start = update.patch_triangles.len() as u32;
        update.patch_triangles.extend(old.map(|old| DrawnId(id(old, face))));
        let middle = update.patch_triangles.len() as u32;
        update.patch_triangles.push(DrawnId(new));
        update.patches.push(Patch { face, old: start..middle, new: middle..middle + 1 });
    }
    update
}

/// Triangles of all slopes and sizes, textured, some with a mask.
fn miniature() -> Scene {
    let texels = vec![[255, 128, 0, 255], [0, 0, 0, 0], [0, 0, 0, 0], [255, 255, 255, 255]];
    let texture = Texture::new("warm-up".to_owned(), [2, 2], texels);
    let map = Some(TextureId(0).into());
    let textured = Material { map_kd: map, map_ke: map, ke: Vec3::ONE, ..Material::grey("textured") };
    let masked = Material { map_d: map, ..Material::grey("masked") };
    let mut scene = Scene { textures: vec![texture], materials: vec![textured, masked], ..Scene::default() };
    let mut state = 1u32;
    let mut random = || {
        // A Weyl sequence through a multiplicative hash: any spread will do.
        state = state.wrapping_add(0x9e37_79b9);
        let x = (state ^ (state >> 16)).wrapping_mul(0x85eb_ca6b);
        (x ^ (x >> 13)) as f32 / u32::MAX as f32 * 2.0 - 1.0
    };
    for i in 0..TRIANGLES {
        let centre = Vec3::new(random(), random(), random());
        for _ in 0..3 {
            scene.positions.push(centre + Vec3::new(random(), random(), random()) * 0.4);
        }
        scene.triangles.push([3 * i, 3 * i + 1, 3 * i + 2]);
        scene.normals.push([Vec3::Z; 3]);
        scene.uvs.push([Vec2::ZERO, Vec2::X * 3.0, Vec2::Y * 3.0]);
        scene.triangle_materials.push(MaterialId(u32::from(i % 4 == 0)));
    }
    let camera = Camera { position: Vec3::Z * 3.0, look_at: Vec3::ZERO, up: Vec3::Y, vertical_fov: 45.0 };
    scene.cameras.push(crate::scene::camera::NamedCamera { name: "warm-up".to_owned(), camera });
    scene
}
