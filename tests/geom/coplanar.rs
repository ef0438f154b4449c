//! Faces that overlap in one plane: one rule decides which is seen, in the id image, for rays and for light.

#![allow(clippy::unwrap_used, reason = "in a test, a panic is how a failure shows")]

use crate::support::binary;
use crate::support::device::*;
use glam::{Vec2, Vec3};
use penombre::geom::Ray;
use penombre::geom::bvh::Bvh;
use penombre::image::exr::read_rgb;
use penombre::scene::camera::ImageSize;
use penombre::scene::coplanar::Coplanar;
use penombre::scene::{EmissionSide, FaceId, Scene, TriangleId};

/// A parallelogram of which the triangles' common corner is one or the other.
fn sheet(scene: &mut Scene, [origin, a, b]: [Vec3; 3], other_diagonal: bool, material: u32) -> [TriangleId; 2] {
    let [p, q, r, s] = [origin, origin + a, origin + a + b, origin + b];
    let cut = if other_diagonal { [[q, r, s], [q, s, p]] } else { [[p, q, r], [p, r, s]] };
    cut.map(|corners| add_triangle(scene, corners, [Vec2::ZERO; 3], material))
}

/// The face that a ray through each pixel's centre meets, plus 1.
fn cast(scene: &Scene, size: ImageSize) -> Vec<u32> {
    let (bvh, view) = (Bvh::build(scene), scene.view(&scene.cameras[0].camera, size));
    let id = |pixel| {
        let direction = view.direction(size.centre_of(pixel));
        let ray = Ray { origin: view.eye, direction, t_max: f32::INFINITY };
        bvh.closest(scene, &ray).map_or(0, |hit| hit.face().0 + 1)
    };
    (0..size.pixels()).map(id).collect()
}

const SIZE: ImageSize = ImageSize { width: 160, height: 120 };

/// The id image, after a check that rays see the same but for a few pixels on edges.
fn ids(scene: &mut Scene) -> Vec<u32> {
    scene.coplanar = Coplanar::find(scene);
    let rays = cast(scene, SIZE);
    let mut drawn = rays.clone();
    with_renderer(|renderer| {
        show(renderer, scene, SIZE.width, SIZE.height);
        drawn = renderer.read_layers().unwrap().face_id;
    });
    let differ = drawn.iter().zip(&rays).filter(|(a, b)| a != b).count();
    assert!(differ <= SIZE.pixels() / 200, "{differ} of {} pixels differ", SIZE.pixels());
    drawn
}

/// Materials of the pixels that show anything, with the number of each.
fn materials(scene: &Scene, ids: &[u32]) -> Vec<(u32, bool, usize)> {
    let of = |id: &u32| {
        let face = FaceId(id.checked_sub(1)?);
        Some((scene.triangle_materials[face.triangle().0 as usize].0, face.is_back()))
    };
    let mut all: Vec<_> = ids.iter().filter_map(of).collect();
    all.sort_unstable();
    all.chunk_by(|a, b| a == b).map(|same| (same[0].0, same[0].1, same.len())).collect()
}

/// A leaning sheet that fills the picture, whose front looks at the camera.
const WALL: [Vec3; 3] = [Vec3::new(-3.0, -2.7, -0.4), Vec3::new(6.1, 0.3, 0.5), Vec3::new(-0.2, 5.3, -1.1)];

fn reversed([origin, a, b]: [Vec3; 3]) -> [Vec3; 3] {
    [origin, b, a]
}

#[test]
fn of_two_sides_the_one_that_faces_the_eye_is_seen() {
    for (first, diagonal) in [(true, false), (true, true), (false, false), (false, true)] {
        let mut scene = empty_scene();
        let paint = add_material(&mut scene, |_| {});
        if first {
            sheet(&mut scene, WALL, false, paint);
        }
        sheet(&mut scene, reversed(WALL), diagonal, 0);
        if !first {
            sheet(&mut scene, WALL, false, paint);
        }
        let ids = ids(&mut scene);
        let shown = materials(&scene, &ids);
        assert!(
            matches!(shown[..], [(material, false, count)] if material == paint && count > SIZE.pixels() / 2),
            "{shown:?}"
        );
        // From behind, the other one.
        scene.cameras[0].camera.position = Vec3::Z * -3.0;
        let shown = materials(&scene, &cast(&scene, SIZE));
        assert!(matches!(shown[..], [(0, false, _)]), "{shown:?}");
    }
}

#[test]
fn a_marking_lies_on_the_road_whichever_comes_first() {
    let [origin, a, b] = WALL;
    let marking = [origin + a * 0.3 + b * 0.25, a * 0.3, b * 0.5];
    let mut counts = Vec::new();
    for marking_first in [false, true] {
        let mut scene = empty_scene();
        let paint = add_material(&mut scene, |_| {});
        if marking_first {
            sheet(&mut scene, marking, true, paint);
        }
        sheet(&mut scene, WALL, false, 0);
        if !marking_first {
            sheet(&mut scene, marking, true, paint);
        }
        let ids = ids(&mut scene);
        let shown = materials(&scene, &ids);
        let painted = shown.iter().find(|(material, ..)| *material == paint).unwrap().2;
        // A little in front of the road, where nothing is in doubt.
        let mut apart = empty_scene();
        let paint = add_material(&mut apart, |_| {});
        sheet(&mut apart, WALL, false, 0);
        sheet(&mut apart, [marking[0] + a.cross(b).normalize() * 1e-3, marking[1], marking[2]], true, paint);
        let expected = materials(&apart, &cast(&apart, SIZE));
        let expected = expected.iter().find(|(material, ..)| *material == paint).unwrap().2;
        assert!(painted.abs_diff(expected) * 100 <= expected, "{painted} {expected}");
        counts.push(painted);
    }
    assert_eq!(counts[0], counts[1]);
}

#[test]
fn what_emits_to_the_eye_is_seen_before_what_faces_it() {
    for side in [EmissionSide::Front, EmissionSide::Both] {
        let mut scene = empty_scene();
        let lamp = add_material(&mut scene, |m| m.ke = Vec3::ONE);
        scene.emission_side = side;
        // The lamp fills the ceiling, wound the other way.
        sheet(&mut scene, reversed(WALL), true, lamp);
        sheet(&mut scene, WALL, false, 0);
        let shown = materials(&scene, &ids(&mut scene.clone()));
        let expected = if side == EmissionSide::Both { (lamp, true) } else { (0, false) };
        assert!(matches!(shown[..], [(material, back, _)] if (material, back) == expected), "{side:?}: {shown:?}");
    }
}

#[test]
fn cut_out_masks_show_what_lies_in_the_same_plane() {
    let count_of_masked = |lift: f32| {
        let mut scene = empty_scene();
        let holes = add_texture(&mut scene, 8, 8, |x, y| [255, 255, 255, if (x + y) % 2 == 0 { 255 } else { 0 }]);
        let masked = add_material(&mut scene, |m| m.map_d = Some(holes.into()));
        let [origin, a, b] = WALL;
        sheet(&mut scene, WALL, true, 0);
        add_quad(&mut scene, origin + a.cross(b).normalize() * lift, a, b, masked, 2.0);
        let shown = materials(&scene, &ids(&mut scene.clone()));
        shown.iter().find(|(material, ..)| *material == masked).unwrap().2
    };
    let (in_plane, before) = (count_of_masked(0.0), count_of_masked(1e-4));
    assert!(before > SIZE.pixels() / 4 && in_plane.abs_diff(before) * 100 < before, "{in_plane} {before}");
}

/// A room of which each wall is one quad, with a lamp; `twins` writes each a second time, reversed, of another material or the same.
fn room(twins: Option<&str>) -> String {
    let mut text = String::from("mtllib room.mtl\n");
    for y in [0, 3] {
        text += &format!("v -2 {y} -2\nv 2 {y} -2\nv 2 {y} 2\nv -2 {y} 2\n");
    }
    text += "v -0.6 2.8 -0.6\nv 0.6 2.8 -0.6\nv 0.6 2.8 0.6\nv -0.6 2.8 0.6\n";
    for (material, face) in [
        ("floor", [4, 3, 2, 1]),
        ("white", [5, 6, 7, 8]),
        ("white", [1, 2, 6, 5]),
        ("left", [4, 1, 5, 8]),
        ("right", [2, 3, 7, 6]),
        ("lamp", [9, 10, 11, 12]),
    ] {
        let [a, b, c, d] = face;
        let twin = twins.map(|name| if name == "same" && material != "lamp" { material } else { "back" });
        // Cut along the other diagonal, and before the face itself.
        text += &twin.map_or(String::new(), |twin| format!("usemtl {twin}\nf {c} {b} {a} {d}\n"));
        text += &format!("usemtl {material}\nf {a} {b} {c} {d}\n");
    }
    text
}

#[test]
fn walls_and_lamps_with_reversed_twins_give_the_light_of_those_without() {
    if !binary::has_device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write(
        "room.mtl",
        "newmtl floor\nKd 0.5 0.4 0.3\nnewmtl white\nKd 0.8 0.8 0.8\nnewmtl left\nKd 0.65 0.06 0.05\nnewmtl right\nKd 0.12 0.45 0.1\n\
         newmtl back\nKd 0.1 0.15 0.9\nnewmtl lamp\nKd 0 0 0\nKe 8 8 7\n",
    );
    let picture = |twins: Option<&str>| {
        write("room.obj", &room(twins));
        write("s.toml", "[geometry]\nobj = \"room.obj\"\n[[camera]]\nposition = [0, 1.5, 6]\nlook_at = [0, 1.5, 0]\n");
        let line = "render s.toml --size 80x60 --rays 600000 --deterministic -o o.exr";
        let output = binary::run(folder.path(), line);
        assert_eq!(output.status.code(), Some(0), "{}", binary::stderr(&output));
        read_rgb(&folder.path().join("o.exr")).unwrap().rgb
    };
    let plain = picture(None);
    let mean = plain.iter().map(|c| c.element_sum()).sum::<f32>();
    for twins in ["other", "same"] {
        let found = picture(Some(twins));
        let difference = plain.iter().zip(&found).map(|(a, b)| (*a - *b).abs().element_sum()).sum::<f32>() / mean;
        println!("{twins}: {difference}");
        // Behind the lamp some of its back's blue is seen by the ceiling.
        assert!(difference < 0.02, "{twins}: {difference}");
    }
}

#[test]
fn scenes_without_overlaps_have_no_such_planes() {
    let mut scene = terrain(12);
    add_quad(&mut scene, Vec3::new(-1.0, -1.0, -1.0), Vec3::X * 2.0, Vec3::Y * 2.0, 0, 1.0);
    assert!(Coplanar::find(&scene).is_empty());
}
