//! What glTF materials become: unlit ones, glass, our own highlight, textures by several coordinates, emission that is a detail.

#![allow(clippy::expect_used, reason = "a test may end where its files cannot be written")]

use super::generated::generate::glb::Glb;
use super::generated::generate::samples::{SQUARE, SQUARE_INDICES, SQUARE_UV};
use glam::Vec3;
use penombre::scene::light::LightKind;
use penombre::scene::load::{Loaded, load};
use penombre::scene::material::Model;
use penombre::scene::{FaceId, TriangleId};
use serde_json::{Value, json};

/// A square of a material; `change` may add to it. All that is said comes as one text.
fn square(material: Value, change: impl FnOnce(&mut Glb, &mut Value)) -> (Loaded, String) {
    let mut glb = Glb::default();
    let (positions, uvs) = (glb.positions(&SQUARE), glb.floats(&SQUARE_UV));
    let indices = glb.indices(&SQUARE_INDICES);
    let mut primitive =
        json!({"attributes": {"POSITION": positions, "TEXCOORD_0": uvs}, "indices": indices, "material": 0});
    change(&mut glb, &mut primitive);
    glb.push("materials", material);
    let mesh = glb.push("meshes", json!({"primitives": [primitive]}));
    glb.root(json!({"mesh": mesh}));
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.glb");
    std::fs::write(&path, glb.bytes()).expect("written");
    let loaded = load(&path).unwrap_or_else(|error| panic!("{error}"));
    let said: Vec<String> = loaded.report.faults.iter().map(ToString::to_string).collect();
    (loaded, said.join("\n"))
}

fn png(texel: impl Fn(u32, u32) -> [u8; 3]) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    let image = image::RgbImage::from_fn(16, 16, |x, y| image::Rgb(texel(x, y)));
    image.write_to(&mut bytes, image::ImageFormat::Png).expect("encoded");
    bytes.into_inner()
}

#[test]
fn unlit_is_seen_on_both_sides_and_lights_nothing() {
    let pbr = json!({"baseColorFactor": [0.25, 0.5, 0.75, 1]});
    let unlit = json!({"doubleSided": true, "pbrMetallicRoughness": pbr, "extensions": {"KHR_materials_unlit": {}}});
    let (Loaded { scene, .. }, said) = square(unlit, |_, _| {});
    // Each triangle twice, once turned over.
    assert_eq!(scene.triangles.len(), 4, "{said}");
    assert_eq!(scene.geometric_normal(TriangleId(0)), -scene.geometric_normal(TriangleId(1)));
    for triangle in [0, 1].map(TriangleId) {
        let face = FaceId::new(triangle, false);
        assert_eq!(scene.emitted_at(face, 0.2, 0.2), Vec3::new(0.25, 0.5, 0.75));
        assert!(scene.face_emits(face) && !scene.face_lights(face));
        assert_eq!(scene.kd_at(triangle, 0.2, 0.2), Vec3::ZERO);
    }
    assert!(scene.lights.iter().all(|light| matches!(light.kind, LightKind::Point { .. })));
}

#[test]
fn our_own_highlight_is_read_from_extras() {
    let pbr = json!({"baseColorFactor": [0.5, 0.5, 0.5, 1], "metallicFactor": 1});
    let of = |penombre: Value| json!({"name": "m", "pbrMetallicRoughness": pbr, "extras": {"penombre": penombre, "other": [1]}});
    let (loaded, said) = square(of(json!({"ks": [0.25, 0.125, 0.5], "ns": 40})), |_, _| {});
    let phong = loaded.scene.materials[0].phong();
    assert_eq!((phong.ks, phong.shininess, said.contains("extras")), (Vec3::new(0.25, 0.125, 0.5), 40.0, false));
    // More than arrives is scaled down.
    let (loaded, _) = square(of(json!({"ks": [1, 0, 0], "ns": 40})), |_, _| {});
    let material = &loaded.scene.materials[0];
    assert!((material.kd + material.phong().ks).max_element() <= 1.0);
    for (wrong, expected) in [
        (json!({"ks": 3}), "its extras name penombre, but not as"),
        (json!({"ks": [0, 0, -1], "ns": 2}), "wants ks of 0 or more and ns above 0"),
    ] {
        let (loaded, said) = square(of(wrong), |_, _| {});
        assert!(said.contains(expected), "{said}");
        assert_eq!(loaded.scene.materials[0].phong().ks, Vec3::ZERO);
    }
}

#[test]
fn roughness_of_specular_glossiness_is_what_gloss_leaves() {
    let other = json!({"diffuseFactor": [0.1, 0.2, 0.3, 1], "glossinessFactor": 0.75});
    let material = json!({"name": "old", "extensions": {"KHR_materials_pbrSpecularGlossiness": other}});
    let (loaded, said) = square(material, |_, _| {});
    let material = &loaded.scene.materials[0];
    let Model::MetallicRoughness(model) = &material.model else { panic!("{material:?}") };
    assert_eq!((material.kd, model.metallic, model.roughness), (Vec3::new(0.1, 0.2, 0.3), 0.0, 0.25));
    assert!(said.contains("KHR_materials_pbrSpecularGlossiness (but for its diffuse colour and glossiness)"), "{said}");
}

#[test]
fn one_set_of_texture_coordinates_is_used() {
    let textures = |base: u32, normal: u32| {
        let pbr = json!({"baseColorTexture": {"index": 0, "texCoord": base}});
        json!({"name": "m", "pbrMetallicRoughness": pbr, "normalTexture": {"index": 0, "texCoord": normal}})
    };
    let second = |glb: &mut Glb, primitive: &mut Value| {
        glb.texture("plain", &png(|x, y| [x as u8, y as u8, 9]));
        primitive["attributes"]["TEXCOORD_1"] = json!(glb.floats(&[[0.5, 0.25]; 4]));
    };
    let (loaded, said) = square(textures(1, 1), second);
    let material = &loaded.scene.materials[0];
    assert!(material.map_kd.is_some() && material.map_normal.is_some() && !said.contains("TEXCOORD"), "{said}");
    assert!(loaded.scene.uvs.iter().flatten().all(|uv| uv.to_array() == [0.5, 0.75]));
    let (loaded, said) = square(textures(1, 0), second);
    let material = &loaded.scene.materials[0];
    assert!(material.map_kd.is_some() && material.map_normal.is_none(), "{material:?}");
    assert!(
        said.contains("material m: its textures have different texture coordinates: those by TEXCOORD_1 alone"),
        "{said}"
    );
}

#[test]
fn a_glowing_detail_is_no_lamp_and_what_is_black_does_not_emit() {
    let glow = json!({"name": "panel", "emissiveFactor": [1, 1, 1], "emissiveTexture": {"index": 0}});
    // A dim dot near a corner of the first triangle's part of the image, of which the second shows another.
    let (Loaded { scene, .. }, said) = square(glow.clone(), |glb, primitive| {
        glb.texture("dot", &png(|x, y| [60 * u8::from((x, y) == (10, 13)); 3]));
        let corners = SQUARE_INDICES.map(|i| SQUARE[i as usize]);
        let uvs = [[0.6, 0.9], [0.9, 0.9], [0.9, 0.6], [0.1, 0.4], [0.4, 0.1], [0.1, 0.1]];
        let [positions, uvs] = [glb.positions(&corners), glb.floats(&uvs)];
        *primitive = json!({"attributes": {"POSITION": positions, "TEXCOORD_0": uvs}, "material": 0});
    });
    assert!(said.contains("no light and what emits is a detail: one point light was added"), "{said}");
    let [area, added] = scene.lights.as_slice() else { panic!("{:?}", scene.lights) };
    assert!(matches!(&area.kind, LightKind::Area { triangles } if *triangles == [TriangleId(0)]), "{area:?}");
    assert_eq!((added.name.as_str(), scene.materials.len()), ("added", 2));
    assert!(scene.materials.iter().all(|material| material.name == "panel"));
    // All of it: a lamp.
    let (loaded, said) = square(glow, |glb, _| {
        glb.texture("white", &png(|_, _| [255; 3]));
    });
    assert!(!said.contains("point light") && loaded.scene.materials.len() == 1, "{said}");
}
