//! What leaves cover: pixels counted from the leaf-id image, and pixels that no leaf covers.
#![allow(clippy::unwrap_used, reason = "in a test, a panic is how a failure shows")]

use crate::support::device::*;
use glam::Vec3;
use penombre::cache::drawn_mesh::DrawnTriangle;
use penombre::cache::ids::{DrawnId, SlotId};
use penombre::pass::{FrameOptions, Renderer, UpdateMode};
use penombre::refine::update::{DrawnPixels, Patch, Slot, Update};
use penombre::scene::{Display, FaceId, Scene};
use std::collections::HashMap;

const FULL: FrameOptions =
    FrameOptions { full_luminance: true, colour: true, combine: None, update_mode: UpdateMode::Stencil, queries: 0 };

const PATCHES: FrameOptions = FrameOptions { full_luminance: false, colour: false, ..FULL };

fn lit(position: Vec3) -> Slot {
    Slot { position, weight: 1.0, diffuse: Vec3::ONE, specular: Vec3::ZERO, light_vector: glam::Vec4::ZERO }
}

/// A face's leaves, each with a value of its own.
struct Painted {
    face: FaceId,
    drawn_triangles: Vec<([Vec3; 3], Vec3)>,
}

/// An update that draws faces for the first time; leaf n is the nth of all leaves, with slots of its own.
fn painted(faces: &[Painted]) -> Update {
    let mut update = Update::default();
    for Painted { face, drawn_triangles } in faces {
        let start = update.drawn_triangles.len() as u32;
        for &(corners, diffuse) in drawn_triangles {
            let id = update.drawn_triangles.len() as u32;
            let slots = [0, 1, 2].map(|k| SlotId(3 * id + k));
            let slot = |position| Slot {
                position,
                weight: 1.0,
                diffuse,
                specular: diffuse * 0.5,
                light_vector: glam::Vec4::ZERO,
            };
            update.slots.extend(slots.into_iter().zip(corners.map(slot)));
            update.drawn_triangles.push((DrawnId(id), DrawnTriangle { slots, face: *face, level: 0, flat: None }));
            update.patch_triangles.push(DrawnId(id));
        }
        update.patches.push(Patch { face: *face, old: start..start, new: start..update.drawn_triangles.len() as u32 });
    }
    update
}

/// The four parts of a triangle, `levels` times over.
fn split(corners: [Vec3; 3], levels: u32) -> Vec<[Vec3; 3]> {
    if levels == 0 {
        return vec![corners];
    }
    let [a, b, c] = corners;
    let [ab, bc, ca] = [(a + b) * 0.5, (b + c) * 0.5, (c + a) * 0.5];
    let parts = [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]];
    parts.into_iter().flat_map(|part| split(part, levels - 1)).collect()
}

/// Draws, then checks that every pixel of a face shows a value of that face (`expected`), in the layers and combined.
fn assert_filled(renderer: &mut Renderer, painted_faces: &[Painted], expected: impl Fn(FaceId) -> Vec3) -> u32 {
    renderer.reset_drawn();
    renderer.apply(&painted(painted_faces)).unwrap();
    renderer.frame(&FrameOptions { combine: Some(Display::default()), ..FULL }).unwrap();
    let counts = renderer.drawn_counts().unwrap();
    let layers = renderer.read_layers().unwrap();
    let display = renderer.read_display().unwrap();
    for (i, &id) in layers.face_id.iter().enumerate().filter(|&(_, &id)| id != 0) {
        let value = expected(FaceId(id - 1));
        let (d, s) = (Vec3::from(layers.d[i]), Vec3::from(layers.s[i]));
        assert!((d - value).abs().max_element() < 5e-3 * value.max_element(), "pixel {i} of face {id}: {d}");
        assert!((s - value * 0.5).abs().max_element() < 5e-3 * value.max_element(), "pixel {i} of face {id}: {s}");
        assert!(display[i][0] > 0, "pixel {i} is black");
    }
    counts.uncovered
}

#[test]
fn uncovered_pixels_show_their_neighbours() {
    with_renderer(|renderer| {
        let mut scene = empty_scene();
        add_quad(&mut scene, Vec3::new(-1.0, -1.0, 0.0), Vec3::X * 2.0, Vec3::Y * 2.0, 0, 1.0);
        let visible = faces(&show(renderer, &scene, 96, 96));
        let value = |face: FaceId| Vec3::splat(1.0 + face.0 as f32);
        // Each part of a face stops short of its edges by up to a pixel or two.
        let shrunk = |[a, b, c]: [Vec3; 3]| {
            let centre = (a + b + c) / 3.0;
            [a, b, c].map(|p| p.lerp(centre, 0.06))
        };
        let paint = |&face: &FaceId| {
            let parts = split(scene.corners(face.triangle()), 2);
            Painted { face, drawn_triangles: parts.into_iter().map(|part| (shrunk(part), value(face))).collect() }
        };
        let painted_faces: Vec<Painted> = visible.iter().map(paint).collect();
        let uncovered = assert_filled(renderer, &painted_faces, value);
        assert!(uncovered > 300, "{uncovered}");
    });
}

/// A roof of two slopes seen at an angle.
fn roof(tilt: f32) -> Scene {
    let mut scene = empty_scene();
    let ridge = [Vec3::new(-1.13, 0.21, 0.37), Vec3::new(1.07, 0.21 + tilt, 0.31)];
    add_triangle(&mut scene, [ridge[0], Vec3::new(0.11, -1.03, 0.0), ridge[1]], [glam::Vec2::ZERO; 3], 0);
    add_triangle(&mut scene, [ridge[1], Vec3::new(-0.07, 0.97, -0.9), ridge[0]], [glam::Vec2::ZERO; 3], 0);
    scene
}

#[test]
fn cracks_along_creases_are_closed() {
    with_renderer(|renderer| {
        let mut uncovered = 0;
        for step in 0..24 {
            let scene = roof(0.023 * step as f32);
            let visible = faces(&show(renderer, &scene, 256, 256));
            assert_eq!(visible.len(), 2);
            // One slope is fine, the other whole: T-junctions all along the ridge.
            let paint = |&face: &FaceId| {
                let parts = split(scene.corners(face.triangle()), 6 * (face.0 & 2) / 2);
                Painted { face, drawn_triangles: parts.into_iter().map(|part| (part, Vec3::splat(3.0))).collect() }
            };
            let painted_faces: Vec<Painted> = visible.iter().map(paint).collect();
            uncovered += assert_filled(renderer, &painted_faces, |_| Vec3::splat(3.0));
        }
        println!("{uncovered} pixels in cracks");
        assert!(uncovered > 0, "the scene shows no crack");
    });
}

#[test]
fn pixels_are_counted_as_the_images_show_them() {
    with_renderer(|renderer| {
        let scene = confetti(40);
        let visible = faces(&show(renderer, &scene, 200, 150));
        // Leaf n is painted with its number in base 1000, exact in half floats.
        let mut next = 0;
        let mut paint = |&face: &FaceId| {
            let drawn_triangles = split(scene.corners(face.triangle()), 3).into_iter().map(|part| {
                next += 1;
                (part, Vec3::new(((next - 1) % 1000 + 1) as f32, ((next - 1) / 1000 + 1) as f32, 1.0))
            });
            Painted { face, drawn_triangles: drawn_triangles.collect() }
        };
        let painted_faces: Vec<Painted> = visible.iter().map(&mut paint).collect();
        let update = painted(&painted_faces);
        renderer.apply(&update).unwrap();
        renderer.frame(&FULL).unwrap();
        let counts = renderer.drawn_counts().unwrap();
        let layers = renderer.read_layers().unwrap();
        let mut expected = vec![0; update.drawn_triangles.len()];
        for (d, &id) in layers.d.iter().zip(&layers.face_id).filter(|&(d, &id)| id != 0 && d[2] > 0.0) {
            let drawn = (d[1].round() as usize - 1) * 1000 + d[0].round() as usize - 1;
            expected[drawn] += u32::from(update.drawn_triangles[drawn].1.face.0 + 1 == id);
        }
        let expected = (0..).map(DrawnId).zip(expected).filter(|c| c.1 > 0);
        assert!(counts.drawn_triangles.len() > 800, "{}", counts.drawn_triangles.len());
        // Pixels that no leaf covers show the value of another: few, and told.
        let missing: u32 =
            expected.clone().map(|c| c.1).sum::<u32>() - counts.drawn_triangles.iter().map(|c| c.pixels).sum::<u32>();
        assert!(missing <= counts.uncovered, "{missing} {}", counts.uncovered);
        let known: HashMap<DrawnId, u32> = counts.drawn_triangles.iter().map(|c| (c.drawn, c.pixels)).collect();
        let differing = expected.filter(|(drawn, pixels)| known.get(drawn) != Some(pixels)).count();
        assert!(differing <= counts.uncovered as usize, "{differing}");
        println!("{} drawn_triangles, {} pixels uncovered", counts.drawn_triangles.len(), counts.uncovered);
    });
}

#[test]
fn a_flat_leaf_shows_one_value() {
    with_renderer(|renderer| {
        let scene = roof(0.2);
        let visible = faces(&show(renderer, &scene, 64, 48));
        let mut update = base_update(&scene, visible.iter().copied(), false, |_, p| lit(p));
        let value = Vec3::new(7.0, 5.0, 3.0);
        update.slots.push((SlotId(100), Slot { diffuse: value, specular: value * 2.0, ..lit(Vec3::ONE * 1e3) }));
        update.drawn_triangles[0].1.flat = Some(SlotId(100));
        let flat = update.drawn_triangles[0].1.face;
        renderer.apply(&update).unwrap();
        renderer.frame(&FULL).unwrap();
        let layers = renderer.read_layers().unwrap();
        let ids = &layers.face_id;
        let of = |face: FaceId| (0..ids.len()).filter(move |&i| ids[i] == face.0 + 1);
        assert!(of(flat).count() > 100);
        let is = |shown: [f32; 3], value: Vec3| Vec3::from(shown).abs_diff_eq(value, 0.01);
        assert!(of(flat).all(|i| is(layers.d[i], value) && is(layers.s[i], value * 2.0)));
        assert!(of(visible[1]).all(|i| is(layers.d[i], Vec3::ONE)));
    });
}

/// A leaf as the test knows it.
type KnownTriangle = (DrawnId, FaceId, [Vec3; 3]);

/// An update that splits these leaves; what they become is added to `next`, with ids from `free` on.
fn split_update(drawn_triangles: &[KnownTriangle], next: &mut Vec<KnownTriangle>, free: &mut u32) -> Update {
    let mut update = Update::default();
    for &(old, face, corners) in drawn_triangles {
        let start = update.patch_triangles.len() as u32;
        update.patch_triangles.push(old);
        for part in split(corners, 1) {
            let (id, slots) = (DrawnId(*free), [0, 1, 2].map(|k| SlotId(3 * *free + k)));
            *free += 1;
            let diffuse = Vec3::splat(1.0 + noise(id.0));
            let slot = |position| Slot {
                position,
                weight: 1.0,
                diffuse,
                specular: Vec3::ZERO,
                light_vector: glam::Vec4::ZERO,
            };
            update.slots.extend(slots.into_iter().zip(part.map(slot)));
            update.drawn_triangles.push((id, DrawnTriangle { slots, face, level: 0, flat: None }));
            update.patch_triangles.push(id);
            next.push((id, face, part));
        }
        update.patches.push(Patch { face, old: start..start + 1, new: start + 1..start + 5 });
    }
    update
}

#[test]
fn queries_count_what_the_image_shows() {
    with_renderer(|renderer| {
        assert!(renderer.device().report().precise_queries);
        for update_mode in MODES {
            let scene = terrain(30);
            let visible = faces(&show(renderer, &scene, 320, 240));
            renderer.reset_drawn();
            renderer.apply(&base_update(&scene, visible.iter().copied(), false, |_, p| lit(p))).unwrap();
            renderer.frame(&FULL).unwrap();
            let mut drawn_triangles: Vec<KnownTriangle> =
                visible.iter().map(|&face| (DrawnId(face.0), face, scene.corners(face.triangle()))).collect();
            let (mut free, mut queries, mut pixels) = (2 * scene.triangles.len() as u32, 0, 0);
            while queries < 10_000 {
                let mut next = Vec::new();
                for part in drawn_triangles.chunks(250) {
                    let first = free;
                    renderer.apply(&split_update(part, &mut next, &mut free)).unwrap();
                    let stats = renderer.frame(&FrameOptions { update_mode, queries: 1000, ..PATCHES }).unwrap();
                    let counted = renderer.query_counts().to_vec();
                    assert_eq!((stats.queries as usize, counted.len()), (4 * part.len(), 4 * part.len()));
                    let mut shown = vec![0; (free - first) as usize];
                    for id in renderer.read_layers().unwrap().drawn_id.into_iter().filter(|&id| id > first) {
                        shown[(id - 1 - first) as usize] += 1;
                    }
                    for DrawnPixels { drawn, pixels: count, .. } in &counted {
                        assert_eq!(*count, shown[(drawn.0 - first) as usize], "{update_mode:?}, drawn {drawn:?}");
                    }
                    pixels += stats.query_pixels;
                    queries += counted.len();
                }
                drawn_triangles = next;
            }
            println!("{update_mode:?}: {queries} queries, {pixels} pixels");
            assert!(pixels > 70_000, "{pixels}");
        }
    });
}

#[test]
fn the_largest_patches_are_queried_within_the_budget() {
    with_renderer(|renderer| {
        let mut scene = empty_scene();
        for i in 0..6u32 {
            let width = 0.1 * (i + 1) as f32;
            let origin = Vec3::new(-1.0 + 0.05 * (i * (i + 1)) as f32, -0.5, 0.0);
            add_quad(&mut scene, origin, Vec3::X * width, Vec3::Y, 0, 1.0);
        }
        let visible = faces(&show(renderer, &scene, 128, 96));
        renderer.apply(&base_update(&scene, visible.iter().copied(), false, |_, p| lit(p))).unwrap();
        renderer.frame(&FULL).unwrap();
        let drawn_triangles: Vec<KnownTriangle> =
            visible.iter().map(|&face| (DrawnId(face.0), face, scene.corners(face.triangle()))).collect();
        let mut next = Vec::new();
        renderer.apply(&split_update(&drawn_triangles, &mut next, &mut 100)).unwrap();
        renderer.frame(&FrameOptions { queries: 18, ..PATCHES }).unwrap();
        let counted: Vec<DrawnId> = renderer.query_counts().iter().map(|c| c.drawn).collect();
        // Room for four patches: the two widest quads, of two faces each.
        let wide = next.iter().filter(|(_, face, _)| face.triangle().0 >= 8);
        assert_eq!(counted.len(), 16);
        assert!(wide.map(|drawn| drawn.0).all(|drawn| counted.contains(&drawn)));
    });
}
