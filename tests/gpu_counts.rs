//! What leaves cover: pixels counted from the leaf-id image, and pixels that no leaf covers.
#![allow(clippy::unwrap_used, reason = "in a test, a panic is how a failure shows")]

mod support;

use glam::Vec3;
use penombre::pass::{FrameOptions, Renderer, UpdateMode};
use penombre::refine::update::{Leaf, LeafId, Patch, Slot, SlotId, Update};
use penombre::scene::{Display, FaceId, Scene};
use support::*;

const FULL: FrameOptions =
    FrameOptions { full_luminance: true, colour: true, combine: None, update_mode: UpdateMode::Stencil };

/// A face's leaves, each with a value of its own.
struct Painted {
    face: FaceId,
    leaves: Vec<([Vec3; 3], Vec3)>,
}

/// An update that draws faces for the first time; leaf n is the nth of all leaves, with slots of its own.
fn painted(faces: &[Painted]) -> Update {
    let mut update = Update::default();
    for Painted { face, leaves } in faces {
        let start = update.leaves.len() as u32;
        for &(corners, diffuse) in leaves {
            let id = update.leaves.len() as u32;
            let slots = [0, 1, 2].map(|k| SlotId(3 * id + k));
            let slot = |position| Slot { position, weight: 1.0, diffuse, specular: diffuse * 0.5 };
            update.slots.extend(slots.into_iter().zip(corners.map(slot)));
            update.leaves.push((LeafId(id), Leaf { slots, face: *face }));
            update.patch_leaves.push(LeafId(id));
        }
        update.patches.push(Patch { face: *face, old: start..start, new: start..update.leaves.len() as u32 });
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
    renderer.reset_leaves();
    renderer.apply(&painted(painted_faces)).unwrap();
    renderer.frame(&FrameOptions { combine: Some(Display::default()), ..FULL }).unwrap();
    let counts = renderer.leaf_counts().unwrap();
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
            Painted { face, leaves: parts.into_iter().map(|part| (shrunk(part), value(face))).collect() }
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
                Painted { face, leaves: parts.into_iter().map(|part| (part, Vec3::splat(3.0))).collect() }
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
            let leaves = split(scene.corners(face.triangle()), 3).into_iter().map(|part| {
                next += 1;
                (part, Vec3::new(((next - 1) % 1000 + 1) as f32, ((next - 1) / 1000 + 1) as f32, 1.0))
            });
            Painted { face, leaves: leaves.collect() }
        };
        let painted_faces: Vec<Painted> = visible.iter().map(&mut paint).collect();
        let update = painted(&painted_faces);
        renderer.apply(&update).unwrap();
        renderer.frame(&FULL).unwrap();
        let counts = renderer.leaf_counts().unwrap();
        let layers = renderer.read_layers().unwrap();
        let mut expected = vec![0; update.leaves.len()];
        for (d, &id) in layers.d.iter().zip(&layers.face_id).filter(|&(d, &id)| id != 0 && d[2] > 0.0) {
            let leaf = (d[1].round() as usize - 1) * 1000 + d[0].round() as usize - 1;
            expected[leaf] += u32::from(update.leaves[leaf].1.face.0 + 1 == id);
        }
        let expected = (0..).map(LeafId).zip(expected).filter(|c| c.1 > 0);
        assert!(counts.leaves.len() > 800, "{}", counts.leaves.len());
        // Pixels that no leaf covers show the value of another: few, and told.
        let missing: u32 = expected.clone().map(|c| c.1).sum::<u32>() - counts.leaves.iter().map(|c| c.1).sum::<u32>();
        assert!(missing <= counts.uncovered, "{missing} {}", counts.uncovered);
        let differing = expected.filter(|c| !counts.leaves.contains(c)).count();
        assert!(differing <= counts.uncovered as usize, "{differing}");
        println!("{} leaves, {} pixels uncovered", counts.leaves.len(), counts.uncovered);
    });
}
