//! The committed glTF samples, against the closed form of what the generator put in.

#![allow(clippy::expect_used, reason = "a test may end where its files cannot be read")]

use super::generated::generate::samples::{self, SQUARE, SQUARE_INDICES, SQUARE_UV};
use glam::{Affine3A, DAffine3, DQuat, DVec3, Vec2, Vec3};
use penombre::scene::light::LightKind;
use penombre::scene::load::{Loaded, load};
use penombre::scene::material::Model;
use penombre::scene::texture::{Encoding, Wrap, srgb_to_linear};
use penombre::scene::{FaceId, Scene, TriangleId};
use std::path::Path;

/// A sample, whose warnings all contain `said`.
fn sample(name: &str, said: &str) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/gltf_samples").join(format!("{name}.glb"));
    let Loaded { scene, report, .. } = load(&path).unwrap_or_else(|error| panic!("{name}: {error}"));
    let usual = |m: &str| m.starts_with("no camera: framed") || m.starts_with("no light and nothing emits");
    for fault in report.faults.iter().filter(|fault| !usual(&fault.message)) {
        assert!(!said.is_empty() && fault.message.contains(said), "{name}: {fault}");
    }
    scene
}

fn close(a: Vec3, b: Vec3) -> bool {
    (a - b).abs().max_element() <= 1e-5 * b.abs().max_element().max(1.0)
}

/// Whether the triangles are those, corner by corner.
fn assert_triangles(scene: &Scene, expected: &[[Vec3; 3]]) {
    assert_eq!(scene.triangles.len(), expected.len());
    for (t, expected) in (0..).zip(expected) {
        let found = scene.corners(TriangleId(t));
        assert!(found.iter().zip(expected).all(|(a, b)| close(*a, *b)), "{t}: {found:?} {expected:?}");
    }
}

/// The two triangles of a square whose corners are moved.
fn square(place: impl Fn(Vec3) -> Vec3) -> Vec<[Vec3; 3]> {
    let corner = |i: u32| place(Vec3::from(SQUARE[i as usize]));
    SQUARE_INDICES.chunks(3).map(|t| [corner(t[0]), corner(t[1]), corner(t[2])]).collect()
}

/// Texture coordinates of the first triangle of the square, v up.
fn square_uvs() -> [Vec2; 3] {
    [0, 1, 2].map(|i| Vec2::new(SQUARE_UV[i][0], 1.0 - SQUARE_UV[i][1]))
}

#[test]
fn nested_instances_are_where_their_transforms_put_them() {
    let scene = sample("instances", "");
    let (translation, angle, scale) = samples::INSTANCE;
    let outer = DAffine3::from_scale_rotation_translation(
        DVec3::splat(scale),
        DQuat::from_rotation_y(angle),
        DVec3::from(translation),
    );
    let (mirror, at) = samples::MIRRORED;
    let inner = outer * DAffine3::from_scale_rotation_translation(mirror.into(), DQuat::IDENTITY, at.into());
    let by = |frame: DAffine3| move |p: Vec3| frame.transform_point3(p.as_dvec3()).as_vec3();
    // Mirrored, the second is wound the other way round, so that its front is still where +z has gone.
    let mirrored = square(by(inner)).into_iter().map(|[a, b, c]| [a, c, b]);
    assert_triangles(&scene, &square(by(outer)).into_iter().chain(mirrored).collect::<Vec<_>>());
    for t in 0..4 {
        assert!(close(scene.geometric_normal(TriangleId(t)), Vec3::X), "{t}");
    }
    assert_eq!(scene.uvs[0], square_uvs());
    assert_eq!(scene.uvs[2], [square_uvs()[0], square_uvs()[2], square_uvs()[1]]);
}

#[test]
fn all_kinds_of_indices_make_the_same_triangles() {
    let scene = sample("indices", "");
    let at = |place: usize| square(move |p| p + Vec3::X * place as f32);
    let mut expected: Vec<[Vec3; 3]> = (0..3).flat_map(at).collect();
    let corner = |place: usize, i: usize| Vec3::from(SQUARE[i]) + Vec3::X * place as f32;
    // A strip 0 1 3 2; a fan begins each triangle with its second corner.
    expected.extend([[0, 1, 3], [1, 2, 3]].map(|t| t.map(|i| corner(3, i))));
    for place in [4, 5] {
        expected.extend([[1, 2, 0], [2, 3, 0]].map(|t| t.map(|i| corner(place, i))));
    }
    assert_triangles(&scene, &expected);
    assert!((0..12).all(|t| scene.geometric_normal(TriangleId(t)) == Vec3::Z));
}

#[test]
fn sparse_values_stand_in_place_of_others() {
    let scene = sample("sparse", "");
    let mut corners = SQUARE.map(Vec3::from);
    samples::SPARSE.iter().for_each(|&(i, p)| corners[i as usize] = p.into());
    let mut expected: Vec<[Vec3; 3]> =
        SQUARE_INDICES.chunks(3).map(|t| [t[0], t[1], t[2]].map(|i| corners[i as usize])).collect();
    expected.push([Vec3::ZERO, samples::SPARSE[0].1.into(), samples::SPARSE[1].1.into()]);
    assert_triangles(&scene, &expected);
}

#[test]
fn quantized_numbers_are_shares() {
    let scene = sample("quantized", "");
    let (positions, scale) = samples::QUANTIZED;
    let corner = |i: u32| Vec3::from(positions[i as usize].map(|c| f32::from(c) / 32767.0)) * scale as f32;
    let expected: Vec<[Vec3; 3]> =
        SQUARE_INDICES.chunks(3).map(|t| [corner(t[0]), corner(t[1]), corner(t[2])]).collect();
    assert_triangles(&scene, &expected);
    let normal = Vec3::from(samples::QUANTIZED_NORMAL.map(|c| f32::from(c) / 127.0)).normalize();
    assert!(scene.normals.iter().flatten().all(|n| close(*n, normal)));
    for (t, of_triangle) in SQUARE_INDICES.chunks(3).enumerate() {
        for (found, &i) in scene.uvs[t].iter().zip(of_triangle) {
            let [u, v] = samples::QUANTIZED_UV[i as usize].map(|c| f32::from(c) / 255.0);
            assert!((*found - Vec2::new(u, 1.0 - v)).length() < 1e-6, "{found}");
        }
    }
}

#[test]
fn textures_are_turned_as_their_transform_says() {
    let scene = sample("texture_transform", "");
    let ([x, y], angle, [sx, sy]) = samples::TRANSFORM;
    let (s, c) = angle.sin_cos();
    for (a, b) in [(0.1, 0.2), (0.6, 0.3), (0.05, 0.9), (0.33, 0.33)] {
        let uv = scene.uv_at(TriangleId(0), a, b);
        // By the file's own rule, v down; counter-clockwise as it is seen.
        let (u, v) = (uv.x * sx, (1.0 - uv.y) * sy);
        let place = Vec2::new(c * u + s * v + x, c * v - s * u + y) * 8.0 - 0.5;
        let texel = |dx: f32, dy: f32| {
            let [x, y] = [place.x.floor() + dx, place.y.floor() + dy].map(|i| i.rem_euclid(8.0) as u32);
            let [r, g, b, _] = samples::texel(x, y).map(|code| srgb_to_linear(f32::from(code) / 255.0));
            Vec3::new(r, g, b)
        };
        let f = place - place.floor();
        let row = |dy| texel(0.0, dy).lerp(texel(1.0, dy), f.x);
        let (found, expected) = (scene.kd_at(TriangleId(0), a, b), row(0.0).lerp(row(1.0), f.y));
        assert!((found - expected).abs().max_element() < 2e-4, "{a} {b}: {found} {expected}");
    }
}

#[test]
fn a_mask_cuts_where_its_cutoff_says() {
    let scene = sample("alpha_mask", "");
    let map = scene.materials[0].map_d.expect("a mask");
    assert_eq!(map.wrap, [Wrap::Clamp, Wrap::Mirror]);
    for x in 0..16 {
        // A texel's middle, near the lower edge of the first triangle, which has all of it.
        let uv = Vec2::new((x as f32 + 0.5) / 16.0, 0.01);
        let (b, c) = (uv.x - uv.y, uv.y);
        assert!((scene.uv_at(TriangleId(0), b, c) - uv).length() < 1e-6);
        let opaque = f32::from(samples::mask_alpha(x)) / 255.0 >= samples::CUTOFF;
        assert_eq!(scene.is_opaque_at(TriangleId(0), b, c), opaque, "{x}");
    }
    // Between texels, where alpha is interpolated: codes 68 and 85 about 76.5.
    for (share, opaque) in [(0.47, false), (0.53, true)] {
        let u = (4.5 + share) / 16.0;
        assert_eq!(scene.is_opaque_at(TriangleId(0), u - 0.01, 0.01), opaque, "{share}");
    }
}

#[test]
fn vertex_colours_multiply_the_base_colour() {
    let scene = sample("vertex_colours", "");
    let base = Vec3::from(samples::COLOURED_BASE);
    for (t, tolerance) in [(0, 1e-6), (2, 0.5 / 255.0), (4, 0.5 / 65535.0)] {
        for (corner, [u, v]) in [(0, [0.0, 0.0]), (1, [1.0, 0.0]), (2, [0.0, 1.0])] {
            let expected = base * Vec3::from(samples::COLOURS[corner]);
            let found = scene.kd_at(TriangleId(t), u, v);
            assert!((found - expected).abs().max_element() <= tolerance + 1e-6, "{t} {corner}: {found} {expected}");
        }
    }
}

#[test]
fn emission_is_factor_by_strength() {
    let scene = sample("emissive_strength", "");
    let (factor, strength) = samples::EMISSION;
    assert_eq!(scene.emitted_at(FaceId::new(TriangleId(1), false), 0.3, 0.3), Vec3::from(factor) * strength);
    assert_eq!(scene.lights.len(), 1);
    assert!(matches!(&scene.lights[0].kind, LightKind::Area { triangles } if triangles.len() == 2));
    assert_eq!(scene.lights[0].name, "lamp");
}

#[test]
fn lights_and_camera_are_in_radiometric_units_and_in_place() {
    let scene = sample("lights", "");
    let (at, point, (spot, angles), sun) = samples::LIGHTS;
    let at = Vec3::from(at.map(|c| c as f32));
    let [beam, ray] = samples::SHINE.map(|d| Vec3::from(d.map(|c| c as f32)).normalize());
    let names: Vec<&str> = scene.lights.iter().map(|light| light.name.as_str()).collect();
    assert_eq!(names, ["lamp", "beam", "sun"]);
    let LightKind::Point { position, intensity } = scene.lights[0].kind else { panic!("{:?}", scene.lights[0]) };
    assert!(position == at && close(intensity, Vec3::new(1.0, 0.5, 0.25) * point as f32), "{intensity}");
    let LightKind::Spot { position, direction, intensity, cos_inner, cos_outer } = scene.lights[1].kind else {
        panic!("{:?}", scene.lights[1])
    };
    assert!(position == at && close(direction, beam) && close(intensity, Vec3::splat(spot as f32)));
    assert!(
        [cos_inner, cos_outer].iter().zip(angles).all(|(c, a)| (f64::from(*c) - a.to_radians().cos()).abs() < 1e-6)
    );
    let LightKind::Directional { direction, irradiance } = scene.lights[2].kind else {
        panic!("{:?}", scene.lights[2])
    };
    assert!(close(direction, ray) && close(irradiance, Vec3::splat(sun as f32)));
    let (position, look_at, fov) = samples::CAMERA;
    let camera = &scene.cameras[0];
    assert_eq!((scene.cameras.len(), camera.name.as_str()), (1, "front"));
    let towards = (DVec3::from(look_at) - DVec3::from(position)).normalize().as_vec3();
    assert!(close((camera.camera.look_at - camera.camera.position).normalize(), towards));
    assert!(close(camera.camera.position, Vec3::from(position.map(|c| c as f32))));
    assert!((f64::from(camera.camera.vertical_fov) - fov).abs() < 1e-4 && camera.camera.up.dot(Vec3::Y) > 0.9);
}

#[test]
fn metal_has_its_factors_and_linear_maps() {
    let scene = sample("metal", "");
    let material = &scene.materials[0];
    let Model::MetallicRoughness(model) = &material.model else { panic!("{material:?}") };
    let (metallic, roughness, scale) = samples::METAL;
    assert_eq!((model.metallic, model.roughness), (metallic, roughness));
    let data = model.map_metallic.expect("a map");
    assert_eq!(model.map_roughness, Some(data));
    let normal = material.map_normal.expect("a normal map");
    assert_eq!(normal.scale, scale);
    for map in [data, normal.map] {
        assert_eq!(scene.texture(&map).encoding(), Encoding::Linear);
    }
    // The middle of the upper left texel: green is roughness, blue metalness, as they are.
    let [r, g, b, _] = samples::texel(0, 0).map(|code| f32::from(code) / 255.0);
    let found = scene.texture(&data).rgb(Vec2::new(0.5 / 8.0, 1.0 - 0.5 / 8.0), data.wrap);
    assert!(close(found, Vec3::new(r, g, b)), "{found}");
}

#[test]
fn nothing_changes_far_from_the_origin() {
    let near = sample("instances", "");
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/gltf_samples/instances.glb");
    let bytes = std::fs::read(path).expect("the sample");
    let text_end = 20 + u32::from_le_bytes(bytes[12..16].try_into().expect("four bytes")) as usize;
    let mut json: serde_json::Value = serde_json::from_slice(&bytes[20..text_end]).expect("its text");
    let nodes = json["nodes"].as_array().expect("nodes").len();
    json["nodes"]
        .as_array_mut()
        .expect("nodes")
        .push(serde_json::json!({"translation": [4_000_000, 0, -6_000_000], "children": [nodes - 1]}));
    json["scenes"][0]["nodes"] = serde_json::json!([nodes]);
    let folder = tempfile::tempdir().expect("a folder");
    let far = folder.path().join("far.glb");
    let moved =
        super::generated::generate::glb::assemble(json.to_string().into_bytes(), bytes[text_end + 8..].to_vec());
    std::fs::write(&far, moved).expect("written");
    let far = load(&far).expect("it loads").scene;
    assert_ne!(far.origin, DVec3::ZERO);
    let shift = (DVec3::new(4e6, 0.0, -6e6) - far.origin).as_vec3();
    let frame = Affine3A::from_translation(shift);
    let expected: Vec<[Vec3; 3]> =
        (0..4).map(|t| near.corners(TriangleId(t)).map(|p| frame.transform_point3(p))).collect();
    assert_triangles(&far, &expected);
}

#[test]
fn the_library_is_the_same_as_glb() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("library.glb");
    std::fs::write(&path, super::generated::generate::library_glb().expect("the library")).expect("written");
    let glb = load(&path).expect("it loads");
    assert!(glb.report.faults.is_empty(), "{:?}", glb.report.faults);
    let toml = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/moonlit_library/moonlit_library.toml");
    let (glb, obj) = (glb.scene, load(&toml).expect("it loads").scene);
    let corners = |scene: &Scene| -> Vec<[Vec3; 3]> {
        (0..scene.triangles.len()).map(|t| scene.corners(TriangleId(t as u32))).collect()
    };
    assert_eq!(corners(&glb), corners(&obj));
    assert_eq!((glb.positions.len(), glb.cameras.len()), (obj.positions.len(), obj.cameras.len()));
    for t in 0..glb.triangles.len() {
        let [a, b] = [&glb, &obj].map(|scene| scene.material(TriangleId(t as u32)));
        assert_eq!(a.name, b.name);
        assert!(close(a.kd, b.kd) && close(a.ke, b.ke) && close(a.phong().ks, b.phong().ks), "{a:?} {b:?}");
        assert!(a.phong().ks == Vec3::ZERO || a.phong().shininess == b.phong().shininess);
        let textured = b.map_kd.is_some() || b.map_ke.is_some() || b.map_d.is_some();
        assert_eq!(
            [a.map_kd.is_some(), a.map_ke.is_some(), a.map_d.is_some()],
            [b.map_kd.is_some(), b.map_ke.is_some(), b.map_d.is_some()]
        );
        for k in 0..3 {
            assert!(close(glb.normals[t][k], obj.normals[t][k]), "{t}");
            assert!(!textured || (glb.uvs[t][k] - obj.uvs[t][k]).length() < 1e-4, "{t}");
        }
    }
    assert_eq!(glb.lights.len(), obj.lights.len());
    for (a, b) in glb.lights.iter().zip(&obj.lights) {
        assert_eq!(a.name, b.name);
        let power = |kind: &LightKind| match *kind {
            LightKind::Point { position, intensity } => [position, intensity, Vec3::ZERO],
            LightKind::Spot { position, intensity, direction, .. } => [position, intensity, direction],
            LightKind::Directional { direction, irradiance } => [direction, irradiance, Vec3::ZERO],
            LightKind::Area { ref triangles } => [Vec3::splat(triangles.len() as f32); 3],
            _ => panic!("no light of the library"),
        };
        assert!(power(&a.kind).iter().zip(power(&b.kind)).all(|(a, b)| close(*a, b)), "{a:?} {b:?}");
    }
}
