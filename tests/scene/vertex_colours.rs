//! Colours of vertices (`v x y z r g b`) as reflectance, on the CPU and on the GPU.
#![allow(clippy::unwrap_used, reason = "in a test, a panic is how a failure shows")]

use crate::support::device::{show, view_of, with_renderer};
use glam::{Vec2, Vec3};
use penombre::pass::{FrameOptions, UpdateMode};
use penombre::scene::load::{Loaded, load};
use penombre::scene::texture::srgb_to_linear;
use penombre::scene::{FaceId, TriangleId};

/// The scene of an OBJ beside an MTL.
fn scene(obj: &str, mtl: &str) -> Loaded {
    let directory = tempfile::tempdir().unwrap();
    std::fs::write(directory.path().join("a.obj"), obj).unwrap();
    std::fs::write(directory.path().join("a.mtl"), mtl).unwrap();
    load(&directory.path().join("a.obj")).unwrap()
}

/// Warnings but for those of a bare OBJ.
fn said(loaded: &Loaded) -> Vec<String> {
    let usual = |m: &str| m.contains("no camera") || m.contains("no light");
    loaded.report.faults.iter().map(ToString::to_string).filter(|m| !usual(m)).collect()
}

fn linear(rgb: [f32; 3]) -> Vec3 {
    Vec3::from(rgb.map(srgb_to_linear))
}

/// k_d at the corners of a triangle.
fn corners(loaded: &Loaded, triangle: u32) -> [Vec3; 3] {
    [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]].map(|[u, v]| loaded.scene.kd_at(TriangleId(triangle), u, v))
}

#[track_caller]
fn assert_near(found: Vec3, expected: Vec3) {
    assert!((found - expected).abs().max_element() < 1e-5, "{found}, not {expected}");
}

const COLOURED: &str = "v 0 0 0 1 0 0\nv 1 0 0 0 0.5 0\nv 0 1 0 0.25 0.25 1\n";

#[test]
fn a_face_without_material_has_the_colours_of_its_vertices() {
    let loaded = scene(&format!("{COLOURED}f 1 2 3\n"), "");
    let expected = [[1.0, 0.0, 0.0], [0.0, 0.5, 0.0], [0.25, 0.25, 1.0]].map(linear);
    corners(&loaded, 0).into_iter().zip(expected).for_each(|(found, expected)| assert_near(found, expected));
    let middle = loaded.scene.kd_at(TriangleId(0), 0.25, 0.5);
    assert_near(middle, expected[0] * 0.25 + expected[1] * 0.25 + expected[2] * 0.5);
    assert_eq!(said(&loaded), Vec::<String>::new());
}

#[test]
fn a_material_with_a_colour_of_its_own_keeps_it() {
    let faces = "mtllib a.mtl\nusemtl own\nf 1 2 3\nusemtl none\nf 3 2 1\nusemtl nowhere\nf 1 3 2\n";
    let loaded = scene(&format!("{COLOURED}{faces}"), "newmtl own\nKd 0.3\nnewmtl none\nKs 0.5\nNs 10\n");
    assert_eq!(corners(&loaded, 0), [Vec3::splat(0.3); 3]);
    // The brightest channel that a vertex may have and the highlight share what arrives.
    let [last, .., first] = corners(&loaded, 1);
    assert_near(first, Vec3::X * (2.0 / 3.0));
    assert_near(last, linear([0.25, 0.25, 1.0]) * (2.0 / 3.0));
    assert_near(corners(&loaded, 2)[0], Vec3::X);
    assert!(said(&loaded).iter().any(|m| m.contains("nowhere: in no MTL file: the vertex colours are used")));
    let unused = scene(&format!("{COLOURED}mtllib a.mtl\nusemtl own\nf 1 2 3\n"), "newmtl own\nKd 0.3\n");
    assert!(unused.scene.colours.is_empty());
    assert!(said(&unused)[0].contains("vertex colours are not used"), "{:?}", said(&unused));
}

#[test]
fn colours_of_all_forms_are_read() {
    // Alpha after the colour; no colour, grey; a weight alone, which is no colour; the same place in another colour.
    let text = "v 0 0 0\nv 1 0 0 0 1 0 0.5\nv 0 1 0 1\nv 0 0 0 0 0 1\nf 1 2 3\nf 4 3 2\n";
    let loaded = scene(text, "");
    let grey = Vec3::splat(0.8);
    for (found, expected) in corners(&loaded, 0).into_iter().zip([grey, Vec3::Y, grey]) {
        assert_near(found, expected);
    }
    assert_near(corners(&loaded, 1)[0], Vec3::Z);
    assert_eq!(loaded.scene.positions.len(), 3, "two colours of one place do not split it");
    assert_eq!(loaded.scene.materials[0].kd, Vec3::ONE);
}

#[test]
fn codes_of_eight_bits_are_scaled_and_said() {
    let loaded = scene("v 0 0 0 255 0 0\nv 1 0 0 0 51 0\nv 0 1 0 0 0 1\nf 1 2 3\n", "");
    let expected = [[1.0, 0.0, 0.0], [0.0, 0.2, 0.0], [0.0, 0.0, 1.0 / 255.0]].map(linear);
    corners(&loaded, 0).into_iter().zip(expected).for_each(|(found, expected)| assert_near(found, expected));
    assert!(
        matches!(&said(&loaded)[..], [one] if one.contains("a.obj:1:") && one.contains("of 255")),
        "{:?}",
        said(&loaded)
    );
    let rounded = scene("v 0 0 0 1.01 0 -0.1\nv 1 0 0 1 0 0\nv 0 1 0 1 0 0\nf 1 2 3\n", "");
    assert_eq!(corners(&rounded, 0), [Vec3::X; 3]);
}

#[test]
fn a_scene_without_colours_carries_none() {
    let loaded = scene("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "");
    assert!(loaded.scene.colours.is_empty());
    assert_eq!(corners(&loaded, 0), [Vec3::splat(0.8); 3]);
}

#[test]
fn the_gpu_interpolates_as_the_cpu_does() {
    with_renderer(|renderer| {
        // Beside a face of its own colour, which is not painted.
        let other = "v 0 1 0\nv 1 0 0\nv 1 1 0\nmtllib a.mtl\nusemtl own\nf 4 5 6\n";
        let loaded = scene(&format!("{COLOURED}f 1 2 3\n{other}"), "newmtl own\nKd 0.3\n");
        let scene = &loaded.scene;
        let options =
            FrameOptions { full_luminance: true, colour: true, combine: None, update_mode: UpdateMode::Id, queries: 0 };
        show(renderer, scene, 64, 48);
        renderer.frame(&options).unwrap();
        let layers = renderer.read_layers().unwrap();
        let view = view_of(scene, 64, 48);
        let mut seen = [0, 0];
        for (i, &id) in layers.face_id.iter().enumerate().filter(|&(_, &id)| id != 0) {
            let triangle = FaceId(id - 1).triangle();
            let direction = view.direction(Vec2::new((i % 64) as f32 + 0.5, (i / 64) as f32 + 0.5));
            let [a, b, c] = scene.corners(triangle);
            let n = (b - a).cross(c - a);
            let p = view.eye + direction * ((a - view.eye).dot(n) / direction.dot(n));
            let [u, v] = [(p - a).cross(c - a), (b - a).cross(p - a)].map(|w| w.dot(n) / n.length_squared());
            let (found, expected) = (Vec3::from(layers.kd[i]), scene.kd_at(triangle, u, v));
            assert!((found - expected).abs().max_element() < 2e-3, "pixel {i}: {found}, not {expected}");
            seen[triangle.0 as usize] += 1;
        }
        assert!(seen[0] > 100 && seen[1] > 100, "{seen:?}");
    });
}
