//! The luminance pass: interpolation, weights, range, and patches against full redraws.
#![allow(clippy::unwrap_used, reason = "in a test, a panic is how a failure shows")]

use crate::support::device::*;
use glam::{Vec2, Vec3};
use penombre::pass::{FrameOptions, Layers, Renderer, UpdateMode};
use penombre::refine::update::{Patch, Slot, Update};
use penombre::scene::{FaceId, Scene};

const FULL: FrameOptions =
    FrameOptions { full_luminance: true, colour: true, combine: None, update_mode: UpdateMode::Stencil, queries: 0 };

fn patches(update_mode: UpdateMode) -> FrameOptions {
    FrameOptions { full_luminance: false, colour: false, combine: None, update_mode, queries: 0 }
}

/// A field of light that is linear in space: interpolation must give it back exactly.
fn linear_light(position: Vec3) -> Slot {
    let diffuse = Vec3::new(2.0, 3.0, 4.0) + position;
    Slot {
        position,
        weight: 1.0,
        diffuse,
        specular: Vec3::splat(1.5) - position.zxy() * 0.5,
        light_vector: glam::Vec4::ZERO,
    }
}

trait Swizzle {
    fn zxy(self) -> Self;
}

impl Swizzle for Vec3 {
    fn zxy(self) -> Self {
        Vec3::new(self.z, self.x, self.y)
    }
}

#[test]
fn a_linear_field_is_interpolated_exactly() {
    with_renderer(|renderer| {
        let scene = confetti(60);
        let visible = show(renderer, &scene, 80, 60);
        renderer.apply(&base_update(&scene, faces(&visible), false, |_, p| linear_light(p))).unwrap();
        renderer.frame(&FULL).unwrap();
        let layers = renderer.read_layers().unwrap();
        let view = view_of(&scene, 80, 60);
        for (i, &id) in layers.face_id.iter().enumerate() {
            if id == 0 {
                assert_eq!((layers.d[i], layers.s[i]), ([0.0; 3], [0.0; 3]));
                continue;
            }
            // The point of the face's plane at the pixel centre.
            let direction = view.direction(Vec2::new((i % 80) as f32 + 0.5, (i / 80) as f32 + 0.5));
            let triangle = FaceId(id - 1).triangle();
            let normal = scene.geometric_normal(triangle);
            let t = (scene.corners(triangle)[0] - view.eye).dot(normal) / direction.dot(normal);
            let light = linear_light(view.eye + direction * t);
            let error =
                (Vec3::from(layers.d[i]) - light.diffuse).abs().max((Vec3::from(layers.s[i]) - light.specular).abs());
            // Half floats near 4 step by 0.004; steep faces add a little of the rasteriser's snapping.
            let steep = 0.02 / normal.dot(direction.normalize()).abs();
            assert!(error.max_element() < 5e-3 + steep * 0.05, "pixel {i}: {error}");
        }
    });
}

#[test]
fn invalid_vertices_take_no_part() {
    with_renderer(|renderer| {
        let mut scene = empty_scene();
        add_quad(&mut scene, Vec3::new(-1.0, -1.0, 0.0), Vec3::X * 2.0, Vec3::Y * 2.0, 0, 1.0);
        let visible = show(renderer, &scene, 32, 32);
        // The first triangle has one invalid corner with a wild value, the second has no valid one.
        let first = scene.corners(visible[0].0.triangle())[0];
        let update = base_update(&scene, faces(&visible), false, |face, position| {
            let valid = face == visible[0].0 && position != first;
            let value = if valid { 5.0 } else { 1000.0 };
            let weight = f32::from(u8::from(valid));
            Slot {
                position,
                weight,
                diffuse: Vec3::splat(value),
                specular: Vec3::splat(value),
                light_vector: glam::Vec4::ZERO,
            }
        });
        renderer.apply(&update).unwrap();
        renderer.frame(&FULL).unwrap();
        let layers = renderer.read_layers().unwrap();
        for (i, &id) in layers.face_id.iter().enumerate().filter(|&(_, &id)| id != 0) {
            let expected = if FaceId(id - 1) == visible[0].0 { 5.0 } else { 0.0 };
            assert!((layers.d[i][1] - expected).abs() < 1e-2 && (layers.s[i][0] - expected).abs() < 1e-2);
        }
    });
}

#[test]
fn values_beyond_half_range_are_scaled() {
    with_renderer(|renderer| {
        let mut scene = empty_scene();
        add_quad(&mut scene, Vec3::new(-1.0, -1.0, 0.0), Vec3::X * 2.0, Vec3::Y * 2.0, 0, 1.0);
        let visible = show(renderer, &scene, 16, 16);
        for (round, value) in [1.0, 4e6, 3e-7].into_iter().enumerate() {
            if round == 2 {
                renderer.reset_drawn();
            }
            let light = |_, position| Slot {
                position,
                weight: 1.0,
                diffuse: Vec3::splat(value),
                specular: Vec3::ZERO,
                light_vector: glam::Vec4::ZERO,
            };
            renderer.apply(&base_update(&scene, faces(&visible), round == 1, light)).unwrap();
            // The second round overflows within an incremental frame, which must notice by itself.
            let options = if round == 1 { patches(UpdateMode::Id) } else { FULL };
            renderer.frame(&options).unwrap();
            let d = renderer.read_layers().unwrap().d;
            assert!((d[8 * 16 + 8][0] / value - 1.0).abs() < 1e-3, "{:?} for {value}", d[8 * 16 + 8]);
        }
    });
}

/// A store may round either way; what is stored must be the nearest 16-bit float all the same.
#[test]
fn luminances_are_rounded_to_nearest() {
    with_renderer(|renderer| {
        let mut scene = empty_scene();
        add_quad(&mut scene, Vec3::new(-1.0, -1.0, 0.0), Vec3::X * 2.0, Vec3::Y * 2.0, 0, 1.0);
        let visible = show(renderer, &scene, 16, 16);
        let mut off = 0.0;
        for i in 0..40 {
            let value = 0.5 + 0.5 * noise(i);
            let light = |_, position| Slot {
                position,
                weight: 1.0,
                diffuse: Vec3::splat(value),
                specular: Vec3::ZERO,
                light_vector: glam::Vec4::ZERO,
            };
            renderer.apply(&base_update(&scene, faces(&visible), i > 0, light)).unwrap();
            renderer.frame(&FULL).unwrap();
            let error = renderer.read_layers().unwrap().d[8 * 16 + 8][0] - value;
            // From 0.5 to 1 they lie 2^-11 apart.
            assert!(error.abs() < 0.51 / 2048.0, "{error} for {value}");
            off += error * 2048.0 / 40.0;
        }
        assert!(off.abs() < 0.15, "{off} steps in the mean");
    });
}

/// Share of pixels whose D differs.
fn differing(a: &Layers, b: &Layers) -> f32 {
    let differs = |(a, b): (&[f32; 3], &[f32; 3])| a.iter().zip(b).any(|(a, b)| (a - b).abs() > 4e-3 * b.abs() + 1e-3);
    a.d.iter().zip(&b.d).filter(|&pair| differs(pair)).count() as f32 / a.d.len() as f32
}

/// Confetti before a cut-out screen.
fn scene_to_refine() -> Scene {
    let mut scene = confetti(60);
    let holes = add_texture(&mut scene, 4, 4, |x, y| [255, 255, 255, if (x + y) % 2 == 0 { 255 } else { 0 }]);
    let masked = add_material(&mut scene, |m| m.map_d = Some(holes.into()));
    add_quad(&mut scene, Vec3::new(-1.0, -1.0, 1.2), Vec3::X * 2.0, Vec3::Y * 2.0, masked, 2.0);
    add_quad(&mut scene, Vec3::new(-1.5, -1.5, -1.5), Vec3::X * 3.0, Vec3::Y * 3.0, 0, 1.0);
    scene
}

fn compare_with_full(renderer: &mut Renderer, mode: UpdateMode, what: &str) {
    let stats = renderer.frame(&patches(mode)).unwrap();
    assert!(stats.triangles_drawn > 0, "{what}: nothing was drawn");
    while renderer.has_pending() {
        renderer.frame(&patches(mode)).unwrap();
    }
    let by_patches = renderer.read_layers().unwrap();
    renderer.frame(&FULL).unwrap();
    let full = renderer.read_layers().unwrap();
    let share = differing(&by_patches, &full);
    // At silhouettes the full redraw shows other faces than the id image in a few pixels of 10,000 (docs/lavapipe.md).
    assert!(share < 2e-3, "{mode:?}, {what}: {share} of the pixels differ");
}

#[test]
fn patches_give_what_a_full_redraw_gives() {
    with_renderer(|renderer| {
        assert!(renderer.stencil_works());
        for mode in MODES {
            let scene = scene_to_refine();
            let visible = faces(&show(renderer, &scene, 160, 120));
            let mut mesh = Splitter::new(&scene, &visible);
            renderer.apply(&base_update(&scene, visible.iter().copied(), false, |_, p| mesh.slot(p))).unwrap();
            renderer.frame(&FULL).unwrap();
            renderer.apply(&mesh.split(0.4)).unwrap();
            compare_with_full(renderer, mode, "one split");
            renderer.apply(&mesh.change(0.3)).unwrap();
            compare_with_full(renderer, mode, "one change of values");
            // Level upon level without a full redraw between: depth must follow what was drawn.
            for _ in 0..3 {
                renderer.apply(&mesh.split(0.4)).unwrap();
                renderer.frame(&patches(mode)).unwrap();
                renderer.apply(&mesh.change(0.3)).unwrap();
                renderer.frame(&patches(mode)).unwrap();
            }
            renderer.apply(&mesh.split(0.4)).unwrap();
            compare_with_full(renderer, mode, "four levels");
            // Leaves that are split, changed and split again before they are ever drawn.
            renderer.apply(&mesh.split(0.5)).unwrap();
            renderer.apply(&mesh.change(0.2)).unwrap();
            renderer.apply(&mesh.split(0.5)).unwrap();
            renderer.apply(&mesh.change(0.2)).unwrap();
            compare_with_full(renderer, mode, "several updates in a frame");
        }
    });
}

/// A terrain with its base triangles as update 1, not drawn yet.
fn show_terrain(renderer: &mut Renderer) -> Splitter {
    let scene = terrain(48);
    let visible = faces(&show(renderer, &scene, 240, 240));
    let mesh = Splitter::new(&scene, &visible);
    renderer.reset_drawn();
    let base = base_update(&scene, visible.iter().copied(), false, |_, p| mesh.slot(p));
    renderer.apply(&Update { sequence: 1, ..base }).unwrap();
    mesh
}

#[test]
fn what_waits_for_later_frames_is_drawn_in_order() {
    with_renderer(|renderer| {
        for mode in MODES {
            let mut mesh = show_terrain(renderer);
            let mut sequence = 2;
            let mut send = |renderer: &mut Renderer, update: Update| {
                renderer.apply(&Update { sequence, ..update }).unwrap();
                sequence += 1;
            };
            renderer.frame(&FULL).unwrap();
            assert_eq!(renderer.drawn_sequence(), 1);
            // Four times as many leaves as a frame draws; then changes to those drawn already and to those that wait.
            send(renderer, mesh.split(1.0));
            let stats = renderer.frame(&patches(mode)).unwrap();
            assert!(stats.triangles_drawn > 4000 && stats.triangles_drawn < 18_000, "{stats:?}");
            assert_eq!(renderer.drawn_sequence(), 1);
            send(renderer, mesh.change(0.2));
            renderer.frame(&patches(mode)).unwrap();
            send(renderer, mesh.split(0.3));
            send(renderer, mesh.change(0.2));
            renderer.frame(&patches(mode)).unwrap();
            assert!(renderer.has_pending());
            compare_with_full(renderer, mode, "what waited");
            assert_eq!(renderer.drawn_sequence(), 5);
        }
    });
}

/// The pixels of new triangles can be counted as soon as those are drawn, whatever values have changed before.
#[test]
fn new_values_do_not_keep_new_triangles_waiting() {
    with_renderer(|renderer| {
        for mode in MODES {
            let mut mesh = show_terrain(renderer);
            renderer.apply(&Update { sequence: 2, ..mesh.split(1.0) }).unwrap();
            renderer.frame(&FULL).unwrap();
            renderer.apply(&Update { sequence: 3, ..mesh.change(1.0) }).unwrap();
            renderer.apply(&Update { sequence: 4, ..mesh.split(0.05) }).unwrap();
            renderer.frame(&patches(mode)).unwrap();
            assert!(renderer.has_pending() && renderer.drawn_sequence() == 4, "{mode:?}");
            compare_with_full(renderer, mode, "values that waited");
        }
    });
}

#[test]
fn modes_can_be_changed_between_frames() {
    with_renderer(|renderer| {
        let scene = scene_to_refine();
        let visible = faces(&show(renderer, &scene, 96, 96));
        let mut mesh = Splitter::new(&scene, &visible);
        renderer.apply(&base_update(&scene, visible.iter().copied(), false, |_, p| mesh.slot(p))).unwrap();
        renderer.frame(&FULL).unwrap();
        for mode in [UpdateMode::Id, UpdateMode::Stencil, UpdateMode::Stencil, UpdateMode::Id] {
            renderer.apply(&mesh.split(0.4)).unwrap();
            renderer.frame(&patches(mode)).unwrap();
        }
        let by_patches = renderer.read_layers().unwrap();
        renderer.frame(&FULL).unwrap();
        assert!(differing(&by_patches, &renderer.read_layers().unwrap()) < 2e-3);
    });
}

#[test]
fn faces_drawn_for_the_first_time_need_no_full_redraw() {
    with_renderer(|renderer| {
        for mode in MODES {
            let scene = scene_to_refine();
            let visible = faces(&show(renderer, &scene, 96, 96));
            renderer.frame(&FULL).unwrap();
            let mesh = Splitter::new(&scene, &visible);
            for part in visible.chunks(7) {
                renderer.apply(&base_update(&scene, part.iter().copied(), false, |_, p| mesh.slot(p))).unwrap();
                renderer.frame(&patches(mode)).unwrap();
            }
            renderer.apply(&mesh.change(0.3)).unwrap();
            compare_with_full(renderer, mode, "values after first leaves");
        }
    });
}

#[test]
fn faces_without_light_yet_are_dark_not_transparent() {
    with_renderer(|renderer| {
        let scene = scene_to_refine();
        let visible = faces(&show(renderer, &scene, 96, 96));
        let lit: Vec<FaceId> = visible.iter().copied().step_by(2).collect();
        let light = |_, position| Slot {
            position,
            weight: 1.0,
            diffuse: Vec3::ONE,
            specular: Vec3::ZERO,
            light_vector: glam::Vec4::ZERO,
        };
        renderer.apply(&base_update(&scene, lit.iter().copied(), false, light)).unwrap();
        renderer.frame(&FULL).unwrap();
        let layers = renderer.read_layers().unwrap();
        let is_lit = |i: usize| layers.face_id[i] != 0 && lit.contains(&FaceId(layers.face_id[i] - 1));
        let mut counts = [0, 0];
        for i in (0..96 * 96).filter(|&i| layers.face_id[i] != 0) {
            assert_eq!(layers.combined[i][3], 1.0);
            // Neighbours lend light to pixels without.
            let (x, y) = (i % 96, i / 96);
            let mut around = (y.saturating_sub(2)..=(y + 2).min(95))
                .flat_map(|y| (x.saturating_sub(2)..=(x + 2).min(95)).map(move |x| 96 * y + x));
            if is_lit(i) || !around.any(is_lit) {
                assert!((layers.d[i][0] - f32::from(u8::from(is_lit(i)))).abs() < 1e-3);
                counts[usize::from(is_lit(i))] += 1;
            }
        }
        assert!(counts[0] > 100 && counts[1] > 100, "{counts:?}");
    });
}

#[test]
fn an_update_that_contradicts_itself_is_refused() {
    with_renderer(|renderer| {
        show(renderer, &confetti(3), 16, 16);
        let patch = Patch { face: FaceId(0), old: 0..0, new: 5..9 };
        let update = Update { patches: vec![patch], ..Update::default() };
        assert!(renderer.apply(&update).is_err());
    });
}
