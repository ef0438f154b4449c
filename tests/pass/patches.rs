//! Patches of a real engine against full redraws: two renderers take the same updates, one draws what changed, the other
//! everything.
#![allow(clippy::unwrap_used, reason = "in a test, a panic is how a failure shows")]

use crate::support::device::*;
use glam::{Vec2, Vec3};
use penombre::cache::ids::NodeId;
use penombre::estimate::hemisphere::Method;
use penombre::geom::bvh::Bvh;
use penombre::pass::{FrameOptions, Layers, Renderer, UpdateMode};
use penombre::refine::engine::{Budget, Counted, Engine, Visible};
use penombre::refine::options::{Options, Pieces, Priority};
use penombre::refine::pixel_lists::FaceImage;
use penombre::refine::replay::HostMesh;
use penombre::refine::update::{DrawnId, DrawnTriangle, Patch, Slot, SlotId, Update};
use penombre::refine::workers::Workers;
use penombre::scene::camera::{Camera, ImageSize};
use penombre::scene::light::{Light, LightKind};
use penombre::scene::{FaceId, Scene, TriangleId};
use std::collections::HashMap;
use std::sync::Arc;

const SIZE: ImageSize = ImageSize { width: 240, height: 180 };

/// A floor and a wall under a point light, and blades that throw crisp shadows on both.
fn shadows() -> Scene {
    let mut scene = empty_scene();
    add_quad(&mut scene, Vec3::new(-1.0, -1.0, 1.0), Vec3::X * 2.0, Vec3::Z * -2.0, 0, 1.0);
    add_quad(&mut scene, Vec3::new(-1.0, -1.0, -1.0), Vec3::X * 2.0, Vec3::Y * 2.0, 0, 1.0);
    for i in 0..4 {
        let at = Vec3::new(-0.7 + 0.4 * i as f32, -0.75, -0.3 + 0.17 * i as f32);
        add_quad(&mut scene, at, Vec3::new(0.21, 0.0, 0.06), Vec3::Y * 0.6, 0, 1.0);
    }
    let kind = LightKind::Point { position: Vec3::new(0.3, 0.8, 1.4), intensity: Vec3::splat(6.0) };
    scene.lights.push(Light { name: "lamp".to_owned(), kind });
    scene
}

/// Frontal to the wall, oblique, and grazing over the floor.
const EYES: [(Vec3, Vec3); 3] = [
    (Vec3::new(0.0, 0.0, 3.2), Vec3::ZERO),
    (Vec3::new(2.1, 1.3, 2.2), Vec3::new(0.0, -0.5, 0.0)),
    (Vec3::new(0.9, -0.86, 1.6), Vec3::new(-0.4, -0.95, -0.4)),
];

/// Two renderers and an engine on one scene and view.
struct Twins {
    patched: Renderer,
    full: Renderer,
    engine: Engine,
    mesh: HostMesh,
}

/// What differs between the twins' images.
#[derive(Debug, Default)]
struct Differences {
    /// Pixels that still show a leaf which is gone, where the full redraw shows a leaf of their face.
    stale: usize,
    /// The same where it shows none: cracks.
    cracks: usize,
    /// Pixels that show the same leaf with another value.
    values: usize,
    /// Pixels that show another leaf of the mesh.
    other: usize,
    pixels: usize,
}

impl Twins {
    fn new(device: &Arc<penombre::vk::Device>, scene: &Scene, (eye, look_at): (Vec3, Vec3)) -> Self {
        let camera = Camera { position: eye, look_at, up: Vec3::Y, vertical_fov: 45.0 };
        let view = scene.view(&camera, SIZE);
        let options = Options {
            indirect: false,
            filter: true,
            hemisphere: Method::Stratified,
            seed: 1,
            max_light_groups: 128,
            priority: Priority::Error,
            min_pixels: 3.0,
            listed: true,
            contrast: 0.02,
            shadow_size: 0.05,
            shadow_pixels: f32::INFINITY,
            white: f32::INFINITY,
            tolerance: 1e-3,
            without: Pieces::default(),
        };
        let bvh = Arc::new(Bvh::build(scene));
        let engine = Engine::new(Arc::new(scene.clone()), bvh, Workers::new(1, false).unwrap(), options);
        let renderer = || Renderer::new(Arc::clone(device), SIZE).unwrap();
        let mut twins = Self { patched: renderer(), full: renderer(), engine, mesh: HostMesh::default() };
        let mut visible = Vec::new();
        for renderer in [&mut twins.patched, &mut twins.full] {
            renderer.load(scene).unwrap();
            renderer.resize(SIZE).unwrap();
            renderer.set_view(&view, Vec2::ZERO);
            visible = renderer.visibility().unwrap();
        }
        let image = Some(FaceImage { view, faces: twins.patched.face_ids().into() });
        let update = twins.engine.set_visible(&Visible { generation: 1, eye, image, faces: visible });
        twins.apply(&update);
        twins.patched.frame(&full_redraw()).unwrap();
        twins
    }

    fn apply(&mut self, update: &Update) {
        self.patched.apply(update).unwrap();
        self.full.apply(update).unwrap();
        self.mesh.apply(update).unwrap();
    }

    /// Draws what waits and tells the engine, which then recycles what was replaced.
    fn draw(&mut self, update_mode: UpdateMode) {
        let options = patches(update_mode);
        self.patched.frame(&options).unwrap();
        while self.patched.has_pending() {
            self.patched.frame(&options).unwrap();
        }
        let sequence = self.patched.drawn_sequence();
        self.engine.counted(&Counted { generation: 1, sequence, pixels: Vec::new() });
    }

    fn differences(&mut self) -> Differences {
        self.full.frame(&full_redraw()).unwrap();
        let (a, b) = (self.patched.read_layers().unwrap(), self.full.read_layers().unwrap());
        // What changes until the next one is taken over without being kept in order.
        self.full.draw_all_next();
        let mut found = Differences::default();
        for i in (0..a.face_id.len()).filter(|&i| a.face_id[i] != 0) {
            found.pixels += 1;
            self.compare(&a, &b, i, &mut found);
        }
        found
    }

    fn compare(&self, a: &Layers, b: &Layers, i: usize, found: &mut Differences) {
        let face = FaceId(a.face_id[i] - 1);
        let covered = b.drawn_id[i] != 0 && self.mesh.face(DrawnId(b.drawn_id[i] - 1)) == Some(face);
        if a.drawn_id[i] == b.drawn_id[i] {
            let same = (Vec3::from(a.d[i]) - Vec3::from(b.d[i])).abs().max_element() <= 2e-3 * b.d[i][0].max(1.0);
            found.values += usize::from(!same && a.drawn_id[i] != 0);
        } else if a.drawn_id[i] != 0 && !self.mesh.is_drawn(DrawnId(a.drawn_id[i] - 1)) {
            found.stale += usize::from(covered);
            found.cracks += usize::from(!covered);
        } else {
            found.other += 1;
        }
    }
}

/// Pixels of leaves that the engine lists and the image of drawn triangles does not show, or the other way round, and all.
fn miscounted(twins: &mut Twins) -> [u32; 2] {
    let mut shown: HashMap<NodeId, u32> = HashMap::new();
    for counted in twins.full.drawn_counts().unwrap().drawn_triangles {
        *shown.entry(twins.engine.cache().drawn.triangles[counted.drawn].node).or_default() += counted.pixels;
    }
    let (cache, view) = (twins.engine.cache(), twins.engine.view());
    let leaves = view.visible_leaves(cache).into_iter();
    let pairs = leaves.map(|leaf| (view.leaves[leaf].pixels as u32, shown.get(&leaf).copied().unwrap_or(0)));
    pairs.fold([0, 0], |[off, all], (listed, shown)| [off + listed.abs_diff(shown), all + listed])
}

fn patches(update_mode: UpdateMode) -> FrameOptions {
    FrameOptions { update_mode, ..FrameOptions::default() }
}

fn full_redraw() -> FrameOptions {
    FrameOptions { full_luminance: true, colour: true, ..FrameOptions::default() }
}

#[test]
fn an_engines_patches_leave_nothing_stale() {
    let Some(device) = device() else { return };
    for update_mode in MODES {
        for (number, eyes) in EYES.into_iter().enumerate() {
            let mut twins = Twins::new(&device, &shadows(), eyes);
            let mut worst = Differences::default();
            let mut count = 0;
            for round in 0..60 {
                // Every fourth frame takes several updates, so that leaves come and go unseen.
                for _ in 0..if round % 4 == 3 { 4 } else { 1 } {
                    let update = twins.engine.step(Budget::Rays(if round < 10 { 20 } else { 600 }));
                    count += update.patches.len();
                    twins.apply(&update);
                }
                twins.draw(update_mode);
                let found = twins.differences();
                worst.stale = worst.stale.max(found.stale);
                worst.cracks = worst.cracks.max(found.cracks);
                worst.values = worst.values.max(found.values);
                worst.other = worst.other.max(found.other);
                worst.pixels = found.pixels;
            }
            // Centres of pixels on edges: the rasteriser snaps vertices to its grid. Measured: 0.3 and 0.5 % of two views, 2.7 % of the
            // frontal one, whose grid is that of the pixels.
            let [off, all] = miscounted(&mut twins);
            assert!(all as usize == worst.pixels && off <= all / 30, "{off} of {all} pixels in other leaves");
            println!(
                "{update_mode:?}, view {number}: {off} pixels in other leaves, {count} patches, {} drawn_triangles, {worst:?}",
                twins.mesh.drawn().count()
            );
            assert!(count > 1000, "{count}");
            assert_eq!(worst.values, 0, "a changed value is not shown");
            // Where vertices snap to the rasteriser's grid, edges move as they are split: a pixel on the edge of what is marked can
            // be the new neighbour's, who may not draw it. Measured: 2 to 9 of 16,000 to 20,000 by stencil, none by id.
            let on_edges = if update_mode == UpdateMode::Stencil { worst.pixels / 1000 } else { 0 };
            assert!(worst.stale <= on_edges, "{worst:?}");
            // Pixels where coverage has holes (measured: 1 or 2) or overlaps (1 to 20).
            assert!(worst.cracks <= 10 && worst.other <= worst.pixels / 500, "{worst:?}");
        }
    }
    finish(device);
}

/// Builds the three steps by hand: leaves by corners, old ones by their number in order of creation.
#[derive(Default)]
struct ByHand {
    drawn_triangles: u32,
}

impl ByHand {
    fn patch(&mut self, update: &mut Update, face: FaceId, old: &[u32], new: &[[Vec3; 3]]) {
        let start = update.patch_triangles.len() as u32;
        update.patch_triangles.extend(old.iter().map(|&drawn| DrawnId(drawn)));
        let middle = update.patch_triangles.len() as u32;
        for &corners in new {
            let slots = [0, 1, 2].map(|k| SlotId(3 * self.drawn_triangles + k));
            let diffuse = Vec3::splat(1.0 + self.drawn_triangles as f32);
            let slot = |position| Slot {
                position,
                weight: 1.0,
                diffuse,
                specular: Vec3::ZERO,
                light_vector: glam::Vec4::ZERO,
            };
            update.slots.extend(slots.into_iter().zip(corners.map(slot)));
            update
                .drawn_triangles
                .push((DrawnId(self.drawn_triangles), DrawnTriangle { slots, face, level: 0, flat: None }));
            update.patch_triangles.push(DrawnId(self.drawn_triangles));
            self.drawn_triangles += 1;
        }
        let end = update.patch_triangles.len() as u32;
        update.patches.push(Patch { face, old: start..middle, new: middle..end });
    }

    /// A quad of two faces, then: a leaf split, its neighbour split, the leaf's child split, all merged again. What borders on
    /// a split leaf is drawn through the new midpoint.
    fn steps(&mut self, scene: &Scene, back: bool) -> [Update; 5] {
        let [p, q] = [0, 1].map(|t| FaceId::new(TriangleId(t), back));
        let ([a, b, c], [_, _, d]) = (scene.corners(TriangleId(0)), scene.corners(TriangleId(1)));
        let mid = |x: Vec3, y: Vec3| (x + y) * 0.5;
        let (ab, bc, ca, cd, da) = (mid(a, b), mid(b, c), mid(c, a), mid(c, d), mid(d, a));
        let mut steps: [Update; 5] = std::array::from_fn(|i| Update { sequence: i as u64 + 1, ..Update::default() });
        self.patch(&mut steps[0], p, &[], &[[a, b, c]]); // leaf 0
        self.patch(&mut steps[0], q, &[], &[[a, c, d]]); // leaf 1
        let parts = [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]];
        self.patch(&mut steps[1], p, &[0], &parts); // leaves 2 to 5
        self.patch(&mut steps[1], q, &[1], &[[a, ca, d], [ca, c, d]]); // leaves 6, 7
        self.patch(&mut steps[2], q, &[6, 7], &[[a, ca, da], [ca, c, cd], [da, cd, d], [ca, cd, da]]); // 8 to 11
        let [e, f, g] = [mid(a, ab), mid(ab, ca), mid(ca, a)];
        self.patch(&mut steps[3], p, &[2], &[[a, e, g], [e, ab, f], [g, f, ca], [e, f, g]]);
        self.patch(&mut steps[3], p, &[5], &[[ab, bc, f], [f, bc, ca]]);
        self.patch(&mut steps[3], q, &[8], &[[a, g, da], [g, ca, da]]); // 18, 19
        self.patch(&mut steps[4], p, &[3, 4, 12, 13, 14, 15, 16, 17], &[[a, b, c]]);
        self.patch(&mut steps[4], q, &[9, 10, 11, 18, 19], &[[a, c, d]]);
        steps
    }
}

#[test]
fn a_leaf_its_neighbour_and_its_child_are_split_and_merged() {
    with_renderer(|renderer| {
        for (update_mode, number) in MODES.into_iter().flat_map(|mode| (0..3).map(move |n| (mode, n))) {
            let mut scene = empty_scene();
            let back = number == 1;
            add_quad(&mut scene, Vec3::new(-1.0, -0.9, 0.2), Vec3::X * 2.0, Vec3::new(0.3, 1.7, -0.4), 0, 1.0);
            // Frontal; oblique from behind; grazing at 3 degrees.
            let eye = [Vec3::Z * 2.8, Vec3::new(1.9, 0.4, -2.2), Vec3::new(0.2, -1.9, 0.55)][number];
            scene.cameras[0].camera = Camera { position: eye, look_at: Vec3::ZERO, up: Vec3::Y, vertical_fov: 50.0 };
            let mut hand = ByHand::default();
            let steps = hand.steps(&scene, back);
            let mut pixels = 0;
            for shown in 1..=4 {
                assert_eq!(show(renderer, &scene, 256, 200).len(), 2);
                let draws = [full_redraw()].into_iter().chain(std::iter::repeat_n(patches(update_mode), shown));
                for (step, draw) in steps.iter().zip(draws) {
                    renderer.apply(step).unwrap();
                    renderer.frame(&draw).unwrap();
                }
                let by_patches = renderer.read_layers().unwrap();
                renderer.frame(&full_redraw()).unwrap();
                let full = renderer.read_layers().unwrap();
                let differing = by_patches.drawn_id.iter().zip(&full.drawn_id).filter(|(a, b)| a != b).count();
                pixels = full.face_id.iter().filter(|&&id| id != 0).count();
                // On edges that moved by a step of the rasteriser's grid.
                assert!(differing <= 2, "{update_mode:?}, view {number}, step {shown}: {differing} pixels differ");
            }
            println!("{update_mode:?}, view {number}: {pixels} pixels");
            assert!(pixels > 900, "{pixels}");
        }
    });
}
