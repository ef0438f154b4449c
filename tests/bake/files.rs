//! The files, read back: PLY by its header, glTF by the crate `gltf`.

use crate::support::by_hand::{light, material, patch};
use crate::{all_light, bake};
use glam::{DVec3, Vec3};
use gltf::Semantic;
use penombre::bake::baker::Plan;
use penombre::bake::lit_mesh::{LitMesh, Vertex};
use penombre::bake::{glb, ply};
use penombre::image::tone_mapping;
use penombre::scene::light::LightKind;
use penombre::scene::material::TextureMap;
use penombre::scene::texture::{Texture, TextureId};
use penombre::scene::{Display, Scene};
use std::collections::HashMap;
use std::fs;

/// A textured floor beside an emissive one, under a lamp.
fn scene() -> Scene {
    let mut scene = Scene::default();
    let texel = |i: usize| if i.is_multiple_of(3) { [200, 100, 50, 255] } else { [20, 220, 120, 255] };
    scene.textures.push(Texture::new("t".to_owned(), [4, 2], (0..8).map(texel).collect()));
    let textured = material(&mut scene, |m| (m.kd, m.map_kd) = (Vec3::ONE, Some(TextureMap::from(TextureId(0)))));
    let lamp = material(&mut scene, |m| (m.kd, m.ke) = (Vec3::splat(0.5), Vec3::new(3.0, 2.0, 1.0)));
    patch(&mut scene, Vec3::ZERO, Vec3::X, Vec3::Y, 2, textured);
    let triangles = patch(&mut scene, Vec3::X * 2.0, Vec3::X, Vec3::Y, 1, lamp);
    light(&mut scene, LightKind::Point { position: Vec3::new(0.5, 0.5, 0.6), intensity: Vec3::new(1.0, 0.9, 0.8) });
    light(&mut scene, LightKind::Area { triangles });
    scene
}

fn baked(scene: &Scene) -> LitMesh {
    let plan = Plan { per_light: true, texel: Some(0.01), ..Plan::default() };
    bake(scene, all_light(), plan, 200_000)
}

/// Values of the vertices of a PLY file by property, and its triangles.
fn read_ply(bytes: &[u8]) -> (HashMap<String, Vec<f64>>, Vec<[i32; 3]>) {
    let end = b"end_header\n";
    let at = bytes.windows(end.len()).position(|w| w == end).unwrap() + end.len();
    let header = std::str::from_utf8(&bytes[..at]).unwrap();
    let mut counts = header
        .lines()
        .filter_map(|line| line.strip_prefix("element "))
        .map(|line| line.split(' ').nth(1).unwrap().parse::<usize>().unwrap());
    let [vertices, faces] = [(); 2].map(|()| counts.next().unwrap());
    let properties: Vec<(&str, &str)> = header
        .lines()
        .filter_map(|line| line.strip_prefix("property "))
        .filter(|line| !line.starts_with("list"))
        .map(|line| line.split_once(' ').unwrap())
        .collect();
    assert!(header.contains("property list uchar int vertex_indices\n"));
    let (mut values, mut rest): (HashMap<String, Vec<f64>>, &[u8]) = (HashMap::new(), &bytes[at..]);
    for (kind, name) in (0..vertices).flat_map(|_| properties.iter()) {
        let value = match *kind {
            "float" => f64::from(f32::from_le_bytes(*rest.split_off(..4).unwrap().as_array().unwrap())),
            "double" => f64::from_le_bytes(*rest.split_off(..8).unwrap().as_array().unwrap()),
            "uchar" => f64::from(rest.split_off(..1).unwrap()[0]),
            other => panic!("{other}"),
        };
        values.entry((*name).to_owned()).or_default().push(value);
    }
    let mut triangles = Vec::new();
    for _ in 0..faces {
        assert_eq!(rest.split_off(..1).unwrap(), [3]);
        triangles.push([(); 3].map(|()| i32::from_le_bytes(*rest.split_off(..4).unwrap().as_array().unwrap())));
    }
    assert!(rest.is_empty());
    (values, triangles)
}

#[test]
fn a_ply_holds_the_mesh() {
    let mut mesh = baked(&scene());
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.ply");
    let display = Display { exposure: -1.0, ..Display::default() };
    for origin in [DVec3::ZERO, DVec3::new(4e6, 1e6, 0.125)] {
        mesh.origin = origin;
        ply::write(&path, &mesh, &display).unwrap();
        let (values, triangles) = read_ply(&fs::read(&path).unwrap());
        let all: Vec<_> = crate::vertices(&mesh).collect();
        assert_eq!((values["x"].len(), triangles.len()), (all.len(), mesh.triangle_count()));
        for (i, vertex) in all.iter().enumerate() {
            let vector = |names: [&str; 3]| DVec3::from_array(names.map(|name| values[name][i]));
            assert_eq!(vector(["x", "y", "z"]), vertex.position.as_dvec3() + origin);
            assert_eq!(vector(["nx", "ny", "nz"]), vertex.normal.as_dvec3());
            assert_eq!(vector(["light_r", "light_g", "light_b"]), vertex.light.as_dvec3());
            assert_eq!(vector(["radiance_r", "radiance_g", "radiance_b"]), vertex.radiance.as_dvec3());
            let shown = tone_mapping::display(vertex.radiance, -1.0, display.tone_mapping);
            assert_eq!(vector(["red", "green", "blue"]), DVec3::from_array(shown.map(f64::from)));
            let parts = ["light_0_g", "light_1_g", "light_indirect_g"].map(|name| values[name][i]);
            assert!(
                (parts.iter().sum::<f64>() - f64::from(vertex.light.y)).abs() < 3e-3,
                "{parts:?} {}",
                vertex.light.y
            );
        }
        let first = mesh.parts[0].vertices.len() as i32;
        let second = mesh.parts[1].triangles[0].map(|corner| corner as i32 + first);
        assert_eq!(triangles[mesh.parts[0].triangles.len()], second);
    }
}

/// The words of an accessor.
fn words(blob: &[u8], accessor: &gltf::Accessor) -> impl Iterator<Item = u32> {
    let view = accessor.view().unwrap();
    assert!(view.offset().is_multiple_of(4) && view.length() == accessor.count() * accessor.size());
    blob[view.offset()..view.offset() + view.length()].as_chunks().0.iter().map(|word| u32::from_le_bytes(*word))
}

#[test]
fn a_glb_holds_the_mesh() {
    let scene = scene();
    let mesh = baked(&scene);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.glb");
    glb::write(&path, &scene, &mesh, Some(0.5)).unwrap();
    let bytes = fs::read(&path).unwrap();
    let gltf::Gltf { document, blob } = gltf::Gltf::from_slice(&bytes).unwrap();
    let blob = blob.unwrap();
    let extras: serde_json::Value =
        serde_json::from_str(document.meshes().next().unwrap().extras().as_ref().unwrap().get()).unwrap();
    assert_eq!(extras["penombre"]["scale"], 0.5);
    let lights = serde_json::json!([{ "attribute": "_LIGHT_0", "name": "light 1" }, { "attribute": "_LIGHT_1", "name": "light 2" },
        { "attribute": "_LIGHT_INDIRECT" }]);
    assert_eq!(extras["penombre"]["lights"], lights);
    let primitives: Vec<_> = document.meshes().next().unwrap().primitives().collect();
    assert_eq!(primitives.len(), mesh.parts.len());
    for (primitive, part) in primitives.iter().zip(&mesh.parts) {
        let floats =
            |semantic| words(&blob, &primitive.get(&semantic).unwrap()).map(f32::from_bits).collect::<Vec<_>>();
        let of =
            |value: fn(&Vertex) -> Vec3| part.vertices.iter().flat_map(|v| value(v).to_array()).collect::<Vec<_>>();
        assert_eq!(floats(Semantic::Positions), of(|v| v.position));
        assert_eq!(floats(Semantic::Normals), of(|v| v.normal));
        assert_eq!(floats(Semantic::Extras("LIGHT".to_owned())), of(|v| v.light));
        assert_eq!(primitive.indices().unwrap().data_type(), gltf::accessor::DataType::U32);
        assert!(words(&blob, &primitive.indices().unwrap()).eq(part.triangles.as_flattened().iter().copied()));
        let material = primitive.material();
        assert!(material.unlit() && !material.double_sided());
        let is_lamp = scene.materials[part.material.0 as usize].is_emissive();
        let shorts: Vec<u32> = words(&blob, &primitive.get(&Semantic::Colors(0)).unwrap()).collect();
        let colour =
            |two: &[u32; 2]| [two[0] & 0xffff, two[0] >> 16, two[1] & 0xffff, two[1] >> 16].map(|c| c as f32 / 65535.0);
        for (colour, vertex) in shorts.as_chunks().0.iter().map(colour).zip(&part.vertices) {
            let light = if is_lamp { vertex.radiance } else { vertex.light };
            let wanted = (light / 0.5).min(Vec3::ONE).extend(1.0);
            assert!((glam::Vec4::from_array(colour) - wanted).abs().max_element() < 1e-5, "{colour:?} {wanted}");
        }
        assert_eq!(is_lamp, material.pbr_metallic_roughness().base_color_texture().is_none());
    }
    // The texture is the scene's, and its coordinates are as the format has them: v down.
    let view = match document.images().next().unwrap().source() {
        gltf::image::Source::View { view, mime_type: "image/png" } => view,
        _ => panic!("not a PNG in the file"),
    };
    let png = image::load_from_memory(&blob[view.offset()..view.offset() + view.length()]).unwrap().into_rgb8();
    let wanted: Vec<u8> = scene.textures[0].texels()[..8].iter().flat_map(|[r, g, b, _]| [*r, *g, *b]).collect();
    assert_eq!((png.dimensions(), png.into_raw()), ((4, 2), wanted));
    let uvs: Vec<f32> =
        words(&blob, &primitives[0].get(&Semantic::TexCoords(0)).unwrap()).map(f32::from_bits).collect();
    let wanted: Vec<f32> = mesh.parts[0].vertices.iter().flat_map(|v| [v.uv.x, 1.0 - v.uv.y]).collect();
    assert_eq!(uvs, wanted);
}

/// What a bake writes, the loader reads.
#[test]
fn a_baked_file_is_a_scene() {
    let scene = scene();
    let mesh = baked(&scene);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.glb");
    glb::write(&path, &scene, &mesh, None).unwrap();
    let loaded = penombre::scene::load::load(&path).unwrap();
    assert_eq!(loaded.scene.triangles.len(), mesh.triangle_count());
    assert!(loaded.scene.materials.iter().all(|m| m.unlit));
}
