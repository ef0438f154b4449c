//! Spheres of metal and plastic, from smooth to rough, before a wall: what materials look like under each kind of light.

use super::File;
use super::glb::{Glb, with};
use serde_json::{Value, json};
use std::f64::consts::{PI, TAU};

/// Roughness of the spheres of a row.
pub const ROUGHNESS: [f64; 5] = [0.05, 0.15, 0.3, 0.6, 1.0];
/// Base colours of metal and plastic, linear.
const COLOURS: [[f64; 3]; 2] = [[0.9, 0.6, 0.3], [0.2, 0.4, 0.8]];
const RADIUS: f64 = 0.5;
const RINGS: u32 = 24;

/// The files, in `spheres/`.
pub fn files() -> Vec<File> {
    let scene = |name: &str, text: String| File { path: format!("spheres/{name}.toml"), bytes: text.into_bytes() };
    let light = |text: &str| format!("[geometry]\ngltf = [\"spheres.glb\"]\n{CAMERA}\n[[light]]\n{text}");
    vec![
        File { path: "spheres/spheres.glb".into(), bytes: spheres().bytes() },
        File { path: "spheres/lamp.obj".into(), bytes: LAMP.into() },
        File { path: "spheres/lamp.mtl".into(), bytes: "newmtl lamp\nKd 0 0 0\nKe 12 11 10\n".into() },
        File { path: "spheres/downlight.ies".into(), bytes: downlight().into_bytes() },
        scene("point", light("kind = \"point\"\nposition = [1.5, 4, 3]\nintensity = [60, 60, 60]\n")),
        scene("lamp", format!("[geometry]\ngltf = [\"spheres.glb\"]\nobj = [\"lamp.obj\"]\n{CAMERA}")),
        scene(
            "sky",
            light(
                "kind = \"sky\"\nturbidity = 3\nsun_elevation = 40\nsun_azimuth = 150\n\n[display]\nexposure = -5.5\n",
            ),
        ),
        scene("even", light("kind = \"environment\"\nradiance = [1, 1, 1]\n")),
        scene(
            "downlight",
            light("kind = \"point\"\nposition = [0, 4, 1]\nphotometry = \"downlight.ies\"\nscale = 30\n"),
        ),
    ]
}

const CAMERA: &str = "\n[[camera]]\nname = \"main\"\nposition = [0, 1.6, 7]\nlook_at = [0, 1, 0]\nvertical_fov = 30\n";
const LAMP: &str = "mtllib lamp.mtl\nusemtl lamp\nv -1 4 1\nv 1 4 1\nv 1 4 2.2\nv -1 4 2.2\nf 1 2 3 4\n";

/// Floor, wall and two rows of spheres.
fn spheres() -> Glb {
    let mut glb = Glb::default();
    let mesh = sphere(&mut glb);
    for (row, (name, metallic)) in [("metal", 1.0), ("plastic", 0.0)].into_iter().enumerate() {
        for (k, roughness) in ROUGHNESS.into_iter().enumerate() {
            let name = format!("{name} {roughness}");
            let material = material(&mut glb, &name, COLOURS[row], (metallic, roughness));
            let mesh = glb.push("meshes", json!({"primitives": [with(mesh.clone(), "material", json!(material))]}));
            let place = [(k as f64 - 2.0) * 1.1, RADIUS + 1.1 * row as f64, 0.0];
            glb.root(json!({"name": name, "mesh": mesh, "translation": place}));
        }
    }
    // Matt without a highlight: a Phong material of ours.
    let matt = json!({
        "name": "grey", "extras": {"penombre": {"ks": [0, 0, 0], "ns": 1}},
        "pbrMetallicRoughness": {"baseColorFactor": [0.6, 0.6, 0.6, 1.0], "metallicFactor": 0.0}
    });
    let matt = glb.push("materials", matt);
    let corners =
        [[-6.0, 0.0, 4.0], [6.0, 0.0, 4.0], [6.0, 0.0, -3.0], [-6.0, 0.0, -3.0], [6.0, 5.0, -3.0], [-6.0, 5.0, -3.0]];
    for quad in [[0, 1, 2, 3], [3, 2, 4, 5]] {
        let positions = glb.positions(&quad.map(|i: usize| corners[i]));
        let indices = glb.indices(&[0, 1, 2, 0, 2, 3]);
        let primitive = json!({"attributes": {"POSITION": positions}, "indices": indices, "material": matt});
        let mesh = glb.push("meshes", json!({"primitives": [primitive]}));
        glb.root(json!({"mesh": mesh}));
    }
    glb
}

fn material(glb: &mut Glb, name: &str, colour: [f64; 3], (metallic, roughness): (f64, f64)) -> usize {
    let [r, g, b] = colour;
    let model = json!({"baseColorFactor": [r, g, b, 1.0], "metallicFactor": metallic, "roughnessFactor": roughness});
    glb.push("materials", json!({"name": name, "pbrMetallicRoughness": model}))
}

/// The primitive of a sphere about the origin, which all share.
fn sphere(glb: &mut Glb) -> Value {
    let columns = 2 * RINGS;
    let mut normals = Vec::new();
    for (ring, column) in (0..=RINGS).flat_map(|ring| (0..columns).map(move |column| (ring, column))) {
        let (polar, turn) = (PI * f64::from(ring) / f64::from(RINGS), TAU * f64::from(column) / f64::from(columns));
        normals
            .push([polar.sin() * turn.cos(), polar.cos(), polar.sin() * turn.sin()].map(|x| (x * 1e6).round() / 1e6));
    }
    let mut indices = Vec::new();
    for (ring, column) in (0..RINGS).flat_map(|ring| (0..columns).map(move |column| (ring, column))) {
        let [a, b] = [column, (column + 1) % columns].map(|column| ring * columns + column);
        let [c, d] = [a + columns, b + columns];
        if ring > 0 {
            indices.extend([a, b, c]);
        }
        if ring < RINGS - 1 {
            indices.extend([b, d, c]);
        }
    }
    let positions: Vec<[f32; 3]> = normals.iter().map(|n| n.map(|x| (x * RADIUS) as f32)).collect();
    let normals: Vec<[f32; 3]> = normals.iter().map(|n| n.map(|x| x as f32)).collect();
    let (positions, normals) = (glb.positions(&positions), glb.floats(&normals));
    json!({"attributes": {"POSITION": positions, "NORMAL": normals}, "indices": glb.indices(&indices)})
}

/// A lamp with a bright cone of about 40° and a faint ring, as an IES file: invented.
fn downlight() -> String {
    let angles: Vec<u32> = (0..=45).map(|i| 2 * i).collect();
    let candela = |angle: u32| {
        let t = f64::from(angle) / 20.0;
        (2000.0 * (-t.powi(4)).exp() + if (45..=60).contains(&angle) { 120.0 } else { 0.0 }).round()
    };
    let list = |numbers: Vec<String>| numbers.chunks(10).map(|line| line.join(" ") + "\n").collect::<String>();
    let mut text =
        "IESNA:LM-63-2002\n[TEST] none: invented for Penombre\n[MANUFAC] make-scenes\nTILT=NONE\n".to_owned();
    text += &format!("1 1000 1 {} 1 1 2 0 0 0\n1 1 10\n", angles.len());
    text += &list(angles.iter().map(u32::to_string).collect());
    text += "0\n";
    text += &list(angles.iter().map(|&angle| candela(angle).to_string()).collect());
    text
}
