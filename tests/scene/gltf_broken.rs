//! Broken glTF files: each ends with its message, none with a panic, and what can be drawn is.

#![allow(clippy::expect_used, reason = "a test may end where its files cannot be written")]

use super::generated::generate::glb::assemble;
use penombre::error::Error;
use penombre::scene::light::LightKind;
use penombre::scene::load::load;
use serde_json::{Value, json};
use std::fmt::Write;
use std::path::Path;

/// Three corners of a triangle and their indices.
pub(super) fn buffer() -> Vec<u8> {
    let corners = [[0.0_f32, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let mut out: Vec<u8> = corners.iter().flatten().flat_map(|c| c.to_le_bytes()).collect();
    out.extend([0_u16, 1, 2, 0].iter().flat_map(|i| i.to_le_bytes()));
    out
}

/// A sound file of one triangle, with a light, a camera and a texture, whose bytes are the binary part.
pub(super) fn sound() -> Value {
    json!({
        "asset": {"version": "2.0"},
        "scene": 0, "scenes": [{"nodes": [0, 2, 3]}],
        "nodes": [
            {"children": [1], "translation": [1, 0, 0]}, {"mesh": 0, "scale": [2, 2, 2]}, {"camera": 0, "translation": [0, 0, 4]},
            {"extensions": {"KHR_lights_punctual": {"light": 0}}, "rotation": [0, 0, 0, 1]},
        ],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]}],
        "materials": [{"name": "m", "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.5, 0.5, 1], "metallicFactor": 0}}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 3, "min": [0, 0, 0], "max": [1, 1, 0]},
            {"bufferView": 1, "componentType": 5123, "type": "SCALAR", "count": 3},
        ],
        "bufferViews": [{"buffer": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 36, "byteLength": 6}],
        "buffers": [{"byteLength": 44}],
        "cameras": [{"type": "perspective", "perspective": {"yfov": 0.8, "znear": 0.1}}],
        "extensionsUsed": ["KHR_lights_punctual"],
        "extensions": {"KHR_lights_punctual": {"lights": [{"type": "point", "intensity": 683}]}},
    })
}

/// All that is said of a file, errors and warnings, and how many triangles are drawn.
fn loaded(name: &str, bytes: &[u8]) -> (String, usize) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).expect("written");
    said(&path)
}

fn said(path: &Path) -> (String, usize) {
    let (report, drawn) = match load(path) {
        Ok(loaded) => (loaded.report, loaded.counts.drawn),
        Err(Error::Input(report)) => (report, 0),
        Err(other) => panic!("{other}"),
    };
    let mut lines = String::new();
    for fault in &report.faults {
        let _ = writeln!(lines, "{fault}");
    }
    (lines, drawn)
}

/// A change of the sound file, what is said then, and whether its triangle is drawn all the same.
type Case = (&'static str, fn(&mut Value), &'static str, bool);

/// Changes of what the file holds.
const OF_BUFFERS: [Case; 14] = [
    ("count", |f| f["accessors"][0]["count"] = json!(4), "accessor 0 (POSITION): 4 elements of 12 bytes", false),
    ("endless count", |f| f["accessors"][1]["count"] = json!(u64::MAX), "go beyond buffer view 1", false),
    ("offset", |f| f["accessors"][0]["byteOffset"] = json!(u64::MAX - 3), "go beyond buffer view 0", false),
    ("stride", |f| f["bufferViews"][0]["byteStride"] = json!(16), "16 apart, from 0 on go beyond", false),
    (
        "no accessor",
        |f| f["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = json!(7),
        "accessor 7 (POSITION): it does not exist",
        false,
    ),
    ("no view", |f| f["accessors"][0]["bufferView"] = json!(9), "there is no buffer view 9", false),
    ("no buffer", |f| f["bufferViews"][1]["buffer"] = json!(3), "buffer view 1: there is no buffer 3", false),
    (
        "view too long",
        |f| f["bufferViews"][0]["byteLength"] = json!(4000),
        "buffer view 0 goes beyond its buffer: 4000 bytes",
        false,
    ),
    (
        "buffer too long",
        |f| f["buffers"][0]["byteLength"] = json!(1_000_000_000_000_u64),
        "buffer 0 is cut off: 44 of 1000000000000",
        false,
    ),
    ("type", |f| f["accessors"][0]["type"] = json!("VEC2"), "Vec2 of F32 is no type for it", false),
    ("component type", |f| f["accessors"][1]["componentType"] = json!(5126), "Scalar of F32 is no type for it", false),
    ("unknown type", |f| f["accessors"][1]["componentType"] = json!(1), "its type is none of glTF", false),
    (
        "file away",
        |f| f["buffers"][0]["uri"] = json!("gone%20away.bin"),
        "buffer 0 is in a file that is not there: \"gone%20away.bin\"",
        false,
    ),
    (
        "network",
        |f| f["buffers"][0]["uri"] = json!("https://example.org/a.bin"),
        "buffer 0 is on the network (https:)",
        false,
    ),
];

/// Changes of what stands where.
const OF_NODES: [Case; 12] = [
    ("cycle", |f| f["nodes"][1]["children"] = json!([0]), "node 0 is reached twice", false),
    ("two parents", |f| f["nodes"][2]["children"] = json!([1]), "node 1 is reached twice", false),
    ("no node", |f| f["nodes"][0]["children"] = json!([77]), "there is no node 77", false),
    ("no scene", |f| f["scene"] = json!(5), "there is no scene 5", false),
    ("no mesh", |f| f["nodes"][1]["mesh"] = json!(5), "there is no mesh 5", false),
    (
        "no light",
        |f| f["nodes"][3]["extensions"]["KHR_lights_punctual"]["light"] = json!(4),
        "node 3: there is no light 4",
        false,
    ),
    ("no camera", |f| f["nodes"][2]["camera"] = json!(4), "node 2: there is no camera 4", false),
    ("rotation", |f| f["nodes"][1]["rotation"] = json!([0, 0, 0, 0]), "node 1: its rotation is 0", false),
    (
        "endless",
        |f| f["nodes"][1]["scale"] = json!([1e39, 1, 1]),
        "node 1: its transform is not made of finite numbers",
        false,
    ),
    ("flat", |f| f["nodes"][1]["scale"] = json!([0, 0, 0]), "nothing to draw (triangles without area: 1)", false),
    (
        "dark",
        |f| f["extensions"]["KHR_lights_punctual"]["lights"][0]["intensity"] = json!(-1),
        "light 0: its colour or intensity is negative",
        false,
    ),
    (
        "cone",
        |f| {
            f["extensions"]["KHR_lights_punctual"]["lights"][0] =
                json!({"type": "spot", "spot": {"innerConeAngle": 1, "outerConeAngle": 0.5}})
        },
        "light 0: its cone",
        false,
    ),
];

/// Changes of the rest.
const OF_THE_REST: [Case; 16] = [
    ("version", |f| f["asset"]["version"] = json!("1.0"), "is glTF 1.0: export it as glTF 2.0", false),
    (
        "Draco",
        |f| f["extensionsRequired"] = json!(["KHR_draco_mesh_compression"]),
        "requires KHR_draco_mesh_compression, geometry compressed by Draco",
        false,
    ),
    (
        "meshopt",
        |f| f["extensionsRequired"] = json!(["EXT_meshopt_compression"]),
        "geometry compressed by meshopt: export",
        false,
    ),
    (
        "Basis",
        |f| f["extensionsRequired"] = json!(["KHR_texture_basisu"]),
        "KTX2 (Basis Universal) textures: export",
        false,
    ),
    (
        "unknown",
        |f| f["extensionsRequired"] = json!(["ACME_gizmo"]),
        "requires ACME_gizmo, which is not supported",
        false,
    ),
    (
        "no positions",
        |f| f["meshes"][0]["primitives"][0]["attributes"] = json!({}),
        "mesh 0 primitive 0: it has no POSITION",
        false,
    ),
    ("points", |f| f["meshes"][0]["primitives"][0]["mode"] = json!(0), "points and lines are not drawn", false),
    (
        "no material",
        |f| f["meshes"][0]["primitives"][0]["material"] = json!(6),
        "there is no material 6: grey is used",
        true,
    ),
    (
        "colour",
        |f| f["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] = json!([2, 0, 0, 1]),
        "material m: its base colour is not within 0 and 1",
        true,
    ),
    (
        "emission",
        |f| f["materials"][0]["emissiveFactor"] = json!([-1, 0, 0]),
        "material m: its emission is negative or no number",
        true,
    ),
    ("no texture", |f| f["materials"][0]["emissiveFactor"] = json!([1, 1, 1]), "", true),
    (
        "texture",
        |f| f["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = json!({"index": 3}),
        "material m: there is no texture 3: the constant is used",
        true,
    ),
    (
        "image",
        |f| {
            f["textures"] = json!([{"source": 2}]);
            f["materials"][0]["normalTexture"] = json!({"index": 0});
        },
        "material m: texture 0: there is no image 2",
        true,
    ),
    (
        "no image",
        |f| {
            f["textures"] = json!([{"source": 0}]);
            f["images"] = json!([{"bufferView": 0, "mimeType": "image/png"}]);
            f["materials"][0]["normalTexture"] = json!({"index": 0});
        },
        "image 0: The image format could not be determined: the constant is used",
        true,
    ),
    (
        "glass",
        |f| f["materials"][0]["extensions"] = json!({"KHR_materials_transmission": {"transmissionFactor": 1}}),
        "material m: transmission 1 (glass) is not supported yet",
        false,
    ),
    (
        "coat",
        |f| f["materials"][0]["extensions"] = json!({"KHR_materials_clearcoat": {}, "KHR_materials_sheen": {}}),
        "not supported yet and not used: KHR_materials_clearcoat, KHR_materials_sheen",
        true,
    ),
];

#[test]
fn the_sound_file_is_sound() {
    let text = serde_json::to_vec(&sound()).expect("text");
    assert_eq!(loaded("a.glb", &assemble(text, buffer())), (String::new(), 1));
}

#[test]
fn each_broken_file_says_what_is_wrong() {
    let cases = OF_BUFFERS.iter().chain(&OF_NODES).chain(&OF_THE_REST);
    assert!(cases.clone().count() >= 36);
    for (name, change, expected, drawn) in cases {
        let mut file = sound();
        change(&mut file);
        let (said, triangles) = loaded("a.glb", &assemble(serde_json::to_vec(&file).expect("text"), buffer()));
        assert!(said.contains(expected), "{name}: {said}");
        assert_eq!(triangles, usize::from(*drawn), "{name}: {said}");
    }
}

#[test]
fn broken_text_says_where() {
    let (said, _) = loaded("a.gltf", b"{\n  \"asset\": {\"version\": \"2.0\"},\n  \"meshes\": [{]\n}");
    assert!(said.contains("a.gltf:3: error: is no valid glTF: "), "{said}");
    let (said, _) = loaded("a.gltf", b"{}");
    assert!(said.contains("missing field `asset`"), "{said}");
    let (said, _) = loaded("a.gltf", b"{\"asset\": {\"version\": \"2.0\"}}");
    assert!(said.contains("nothing to draw: there is no face"), "{said}");
    for (bytes, expected) in [
        (&b"glTF\x02\0\0\0"[..], "ends within its header"),
        (b"glTF\x02\0\0\0\x63\0\0\0", "is cut off: 12 of 99 bytes"),
        (b"\x89PNG", "is no valid glTF"),
        (b" ", "is empty"),
    ] {
        let (said, _) = loaded("a.glb", bytes);
        assert!(said.contains(expected), "{said}");
    }
}

#[test]
fn all_faults_are_reported_at_once() {
    let mut file = sound();
    for (name, change, ..) in OF_BUFFERS.iter().chain(&OF_NODES) {
        if ["type", "component type", "no light", "no camera", "rotation", "dark"].contains(name) {
            change(&mut file);
        }
    }
    let (said, _) = loaded("a.glb", &assemble(serde_json::to_vec(&file).expect("text"), buffer()));
    for expected in ["Vec2 of F32", "Scalar of F32", "no light 4", "no camera 4", "its rotation is 0"] {
        assert!(said.contains(expected), "{expected}: {said}");
    }
}

#[test]
fn faces_that_cannot_be_drawn_are_left_out_and_counted() {
    let mut file = sound();
    file["accessors"][1]["count"] = json!(6);
    file["bufferViews"][1]["byteLength"] = json!(12);
    file["buffers"][0]["byteLength"] = json!(48);
    let mut bin = buffer();
    bin.truncate(42);
    bin.extend([0_u16, 1, 65535].iter().flat_map(|i| i.to_le_bytes()));
    let (said, drawn) = loaded("a.glb", &assemble(serde_json::to_vec(&file).expect("text"), bin.clone()));
    assert!(
        drawn == 1 && said.contains("mesh 0 primitive 0 at node 1: 1 triangles have a corner that is no vertex"),
        "{said}"
    );
    // A coordinate that is no number is in both.
    bin[..4].copy_from_slice(&f32::NAN.to_le_bytes());
    let (said, drawn) = loaded("a.glb", &assemble(serde_json::to_vec(&file).expect("text"), bin));
    assert!(drawn == 0 && said.contains("nothing to draw (faces with faults: 2)"), "{said}");
}

#[test]
fn instances_do_not_multiply_without_end() {
    // 20,000 nodes of 20,000 primitives each: 400 million triangles in a file of a megabyte.
    let mut file = sound();
    let primitive = file["meshes"][0]["primitives"][0].clone();
    file["meshes"][0]["primitives"] = json!(vec![primitive; 20_000]);
    file["nodes"] = json!(vec![json!({"mesh": 0}); 20_000]);
    file["scenes"][0]["nodes"] = json!((0..20_000).collect::<Vec<u32>>());
    let (said, _) = loaded("a.glb", &assemble(serde_json::to_vec(&file).expect("text"), buffer()));
    assert!(said.contains("have 400000000 triangles, and 268435456 are the most"), "{said}");
    // Elements that lie nowhere are zeros, however many.
    let mut file = sound();
    for accessor in [0, 1] {
        file["accessors"][accessor]["count"] = json!(u64::MAX / 2);
        file["accessors"][accessor].as_object_mut().expect("an object").remove("bufferView");
    }
    let (said, _) = loaded("a.glb", &assemble(serde_json::to_vec(&file).expect("text"), buffer()));
    assert!(said.contains("are the most"), "{said}");
    // A tree of 3,000 nodes one below another.
    let mut file = sound();
    file["nodes"] = json!((1..3000).map(|k| json!({"children": [k]})).chain([json!({"mesh": 0})]).collect::<Vec<_>>());
    file["scenes"][0]["nodes"] = json!([0]);
    let (said, _) = loaded("a.glb", &assemble(serde_json::to_vec(&file).expect("text"), buffer()));
    assert!(said.contains("lies deeper than 1024 nodes"), "{said}");
}

#[test]
fn lights_that_leave_a_scene_dark_may_be_in_watts() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut file = sound();
    file["extensions"]["KHR_lights_punctual"]["lights"][0] = json!({"type": "directional", "intensity": 3});
    let glb = assemble(serde_json::to_vec(&file).expect("text"), buffer());
    std::fs::write(folder.path().join("a.glb"), glb).expect("written");
    let (dark, drawn) = said(&folder.path().join("a.glb"));
    assert!(drawn == 1 && dark.contains("leave the scene dark: white is lit to 1.4e-3"), "{dark}");
    let text = "[geometry]\ngltf = \"a.glb\"\nlight_units = \"radiometric\"\n";
    std::fs::write(folder.path().join("a.toml"), text).expect("written");
    let loaded = load(&folder.path().join("a.toml")).expect("it loads");
    assert!(loaded.report.faults.is_empty(), "{:?}", loaded.report.faults);
    let LightKind::Directional { direction, irradiance } = loaded.scene.lights[0].kind else { panic!("no sun") };
    assert_eq!((direction, irradiance), (glam::Vec3::NEG_Z, glam::Vec3::splat(3.0)));
}

#[test]
fn scene_files_name_gltf_beside_obj() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, bytes: &[u8]| std::fs::write(folder.path().join(name), bytes).expect("written");
    write("a.glb", &assemble(serde_json::to_vec(&sound()).expect("text"), buffer()));
    write("a.obj", b"v 5 0 0\nv 6 0 0\nv 5 1 0\nf 1 2 3\n");
    write("both.toml", b"[geometry]\nobj = [\"a.obj\"]\ngltf = [\"a.glb\"]\n[[light]]\nname = \"light 1\"\nkind = \"point\"\nposition = [0, 0, 9]\nintensity = [1, 1, 1]\n");
    let scene = load(&folder.path().join("both.toml")).expect("it loads").scene;
    assert_eq!((scene.triangles.len(), scene.materials.len(), scene.cameras.len()), (2, 2, 1));
    assert_eq!(scene.material(penombre::scene::TriangleId(1)).name, "m", "those of glTF come after");
    let names: Vec<&str> = scene.lights.iter().map(|light| light.name.as_str()).collect();
    assert_eq!(names, ["light 1", "light 1 (glTF)"]);
    for (text, expected) in [
        ("[geometry]\nemit = \"both\"\n", "a.toml:1: error: [geometry] lacks obj and gltf"),
        ("[geometry]\ngltf = []\n", "gltf is empty: name at least one file"),
        ("[geometry]\ngltf = [\"b.glb\"]\n", "a.toml:2: error: "),
        ("[geometry]\nobj = [\"a.glb\"]\n", "is glTF: name it in gltf = [...]"),
        ("[geometry]\ngltf = [\"a.obj\"]\n", "a.obj:1: error: is no valid glTF"),
    ] {
        write("a.toml", text.as_bytes());
        let (said, _) = said(&folder.path().join("a.toml"));
        assert!(said.contains(expected), "{said}");
    }
}

#[test]
fn buffers_and_images_may_lie_beside_or_in_the_text() {
    use base64::Engine;
    let folder = tempfile::tempdir().expect("a folder");
    let mut png = std::io::Cursor::new(Vec::new());
    image::RgbImage::from_pixel(2, 2, image::Rgb([255, 0, 0]))
        .write_to(&mut png, image::ImageFormat::Png)
        .expect("encoded");
    std::fs::write(folder.path().join("my image.png"), png.get_ref()).expect("written");
    std::fs::write(folder.path().join("my buffer.bin"), buffer()).expect("written");
    let in_text = |kind: &str, bytes: &[u8]| {
        format!("data:{kind};base64,{}", base64::engine::general_purpose::STANDARD.encode(bytes))
    };
    let places = [
        ("my%20buffer.bin".to_owned(), "my%20image.png".to_owned()),
        (in_text("application/octet-stream", &buffer()), in_text("image/png", png.get_ref())),
    ];
    for (buffer, image) in places {
        let mut file = sound();
        file["buffers"][0]["uri"] = json!(buffer);
        file["images"] = json!([{"uri": image}]);
        file["textures"] = json!([{"source": 0}]);
        file["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = json!({"index": 0});
        std::fs::write(folder.path().join("a.gltf"), file.to_string()).expect("written");
        let loaded = load(&folder.path().join("a.gltf")).expect("it loads");
        assert!(loaded.report.faults.is_empty(), "{:?}", loaded.report.faults);
        let kd = loaded.scene.kd_at(penombre::scene::TriangleId(0), 0.3, 0.3);
        assert!((kd - glam::Vec3::X * 0.5).length() < 1e-6, "{kd}");
    }
}
