//! Ten small glTF files, each with one feature: what is in them is public, so that tests can compare.

use super::File;
use super::glb::{BYTE, Glb, LUMENS_PER_WATT, SHORT, UNSIGNED_BYTE, UNSIGNED_INT, UNSIGNED_SHORT, with};
use glam::DVec3;
use serde_json::{Value, json};
use std::f64::consts::FRAC_PI_2;

/// Corners of a square in the plane z = 0, counter-clockwise from +z.
pub const SQUARE: [[f32; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
/// Its texture coordinates, v down: the top of an image at its upper edge.
pub const SQUARE_UV: [[f32; 2]; 4] = [[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]];
/// Its two triangles.
pub const SQUARE_INDICES: [u32; 6] = [0, 1, 2, 0, 2, 3];

/// A square node under one that is turned by 90° about y, moved and doubled; then one that mirrors it, by a matrix.
pub const INSTANCE: ([f64; 3], f64, f64) = ([1.0, 2.0, 3.0], FRAC_PI_2, 2.0);
/// Scale of the mirrored square below the first node, and where it is.
pub const MIRRORED: ([f64; 3], [f64; 3]) = ([-1.0, 1.0, 0.5], [0.0, 3.0, 0.0]);
/// Positions that a sparse accessor puts in the place of others, by vertex.
pub const SPARSE: [(u16, [f32; 3]); 2] = [(1, [2.0, 0.5, 0.25]), (3, [0.0, 1.5, -1.0])];
/// Positions as shares of 32767, and what the node scales them by.
pub const QUANTIZED: ([[i16; 3]; 4], f64) = ([[0, 0, 0], [32767, 0, 0], [32767, 16384, 0], [-8192, 16384, 0]], 4.0);
/// Normals as shares of 127, texture coordinates as shares of 255.
pub const QUANTIZED_NORMAL: [i8; 3] = [0, 89, 90];
/// Of the four corners.
pub const QUANTIZED_UV: [[u8; 2]; 4] = [[0, 255], [255, 255], [255, 0], [51, 0]];
/// Offset, rotation (radians) and scale of `KHR_texture_transform`.
pub const TRANSFORM: ([f32; 2], f32, [f32; 2]) = ([0.2, -0.1], 0.5, [1.5, 0.75]);
/// Alpha that is opaque.
pub const CUTOFF: f32 = 0.3;
/// Vertex colours, linear, as floats, as shares of 255 and of 65535.
pub const COLOURS: [[f32; 3]; 4] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.2, 0.4, 0.6], [1.0, 1.0, 1.0]];
/// What they multiply.
pub const COLOURED_BASE: [f32; 3] = [0.5, 0.8, 1.0];
/// Emissive factor and strength.
pub const EMISSION: ([f32; 3], f32) = ([1.0, 0.5, 0.25], 12.0);
/// Metalness and roughness factors, the scale of the normal map.
pub const METAL: (f32, f32, f32) = (0.75, 0.5, 0.6);
/// The camera: position, point looked at, degrees.
pub const CAMERA: ([f64; 3], [f64; 3], f64) = ([0.5, 1.5, 4.0], [0.5, 0.5, 0.0], 40.0);
/// Of the point light, at a place, W·sr⁻¹; of the spot, W·sr⁻¹, with its half angles in degrees; of the sun, W·m⁻².
pub const LIGHTS: ([f64; 3], f64, (f64, [f64; 2]), f64) = ([0.5, 0.5, 2.0], 3.0, (5.0, [10.0, 25.0]), 0.75);
/// Which way spot and sun shine.
pub const SHINE: [[f64; 3]; 2] = [[0.0, -0.6, -0.8], [0.36, -0.48, -0.8]];

/// The files, in `gltf_samples/`.
///
/// # Errors
/// If an image cannot be encoded.
pub fn files() -> image::ImageResult<Vec<File>> {
    let file = |name: &str, glb: Glb| File { path: format!("gltf_samples/{name}.glb"), bytes: glb.bytes() };
    Ok(vec![
        file("instances", instances()),
        file("indices", indices()),
        file("sparse", sparse()),
        file("quantized", quantized()),
        file("texture_transform", texture_transform()?),
        file("alpha_mask", alpha_mask()?),
        file("vertex_colours", vertex_colours()),
        file("emissive_strength", emissive_strength()),
        file("lights", lights()),
        file("metal", metal()?),
    ])
}

/// Attributes and indices of a square.
fn square(glb: &mut Glb) -> Value {
    let (positions, uvs) = (glb.positions(&SQUARE), glb.floats(&SQUARE_UV));
    let indices = glb.indices(&SQUARE_INDICES);
    json!({"attributes": {"POSITION": positions, "TEXCOORD_0": uvs}, "indices": indices})
}

/// A mesh of one primitive.
fn mesh(glb: &mut Glb, primitive: Value) -> usize {
    glb.push("meshes", json!({"primitives": [primitive]}))
}

/// A square of a material at the origin.
fn square_of(glb: &mut Glb, material: Value) {
    let material = glb.push("materials", material);
    let primitive = with(square(glb), "material", json!(material));
    let mesh = mesh(glb, primitive);
    glb.root(json!({"mesh": mesh}));
}

fn png(width: u32, height: u32, texel: impl Fn(u32, u32) -> [u8; 4]) -> image::ImageResult<Vec<u8>> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    image::RgbaImage::from_fn(width, height, |x, y| image::Rgba(texel(x, y)))
        .write_to(&mut bytes, image::ImageFormat::Png)?;
    Ok(bytes.into_inner())
}

fn instances() -> Glb {
    let mut glb = Glb::default();
    let primitive = square(&mut glb);
    let mesh = mesh(&mut glb, primitive);
    let (scale, at) = MIRRORED;
    #[rustfmt::skip]
    let matrix = [scale[0], 0.0, 0.0, 0.0, 0.0, scale[1], 0.0, 0.0, 0.0, 0.0, scale[2], 0.0, at[0], at[1], at[2], 1.0];
    let mirrored = glb.push("nodes", json!({"mesh": mesh, "matrix": matrix}));
    let (translation, angle, scale) = INSTANCE;
    let rotation = [0.0, (angle / 2.0).sin(), 0.0, (angle / 2.0).cos()];
    glb.root(json!({"mesh": mesh, "translation": translation, "rotation": rotation, "scale": [scale, scale, scale], "children": [mirrored]}));
    glb
}

/// The square by each kind of indices, and as a strip and a fan; each a unit further along x.
fn indices() -> Glb {
    let mut glb = Glb::default();
    let positions = glb.positions(&SQUARE);
    let (in_order, in_zigzag) = (SQUARE_INDICES, [0_u32, 1, 3, 2]);
    let fan = [0_u32, 1, 2, 3];
    let bytes = |indices: &[u32], size: usize| -> Vec<u8> {
        indices.iter().flat_map(|i| i.to_le_bytes()[..size].to_vec()).collect()
    };
    let kinds = [
        (Some((&in_order[..], UNSIGNED_BYTE, 1)), 4),
        (Some((&in_order[..], UNSIGNED_SHORT, 2)), 4),
        (Some((&in_order[..], UNSIGNED_INT, 4)), 4),
        (Some((&in_zigzag[..], UNSIGNED_SHORT, 2)), 5),
        (Some((&fan[..], UNSIGNED_BYTE, 1)), 6),
        // Without indices.
        (None, 6),
    ];
    for (place, (list, mode)) in kinds.into_iter().enumerate() {
        let mut primitive = json!({"attributes": {"POSITION": positions}, "mode": mode});
        if let Some((list, component, size)) = list {
            primitive["indices"] = json!(glb.accessor(&bytes(list, size), component, "SCALAR", list.len()));
        }
        let mesh = mesh(&mut glb, primitive);
        glb.root(json!({"mesh": mesh, "translation": [place, 0, 0]}));
    }
    glb
}

/// The square with two corners elsewhere, and a triangle of which only those are given, the third at 0.
fn sparse() -> Glb {
    let mut glb = Glb::default();
    let base = glb.positions(&SQUARE);
    let rows: Vec<u8> = SPARSE.iter().flat_map(|(i, _)| i.to_le_bytes()).collect();
    let values: Vec<u8> = SPARSE.iter().flat_map(|(_, p)| p.map(f32::to_le_bytes).concat()).collect();
    let (rows, values) = (glb.view(&rows, 0), glb.view(&values, 0));
    let sparse = json!({"count": 2, "indices": {"bufferView": rows, "componentType": UNSIGNED_SHORT}, "values": {"bufferView": values}});
    let of = |view: Option<Value>| {
        let accessor = json!({"componentType": 5126, "type": "VEC3", "count": 4, "sparse": sparse});
        view.map_or(accessor.clone(), |view| with(accessor, "bufferView", view))
    };
    let view = glb.push("bufferViews", json!({"buffer": 0, "byteOffset": 0, "byteLength": 48}));
    debug_assert_eq!(base, 0);
    let (moved, alone) = (glb.push("accessors", of(Some(json!(view)))), glb.push("accessors", of(None)));
    let order = glb.indices(&SQUARE_INDICES);
    let three = glb.indices(&[0, 1, 3]);
    for (positions, indices) in [(moved, order), (alone, three)] {
        let mesh = mesh(&mut glb, json!({"attributes": {"POSITION": positions}, "indices": indices}));
        glb.root(json!({"mesh": mesh}));
    }
    glb
}

/// A square by `KHR_mesh_quantization`, its positions eight bytes apart.
fn quantized() -> Glb {
    let mut glb = Glb::default();
    glb.uses("KHR_mesh_quantization");
    let (positions, scale) = QUANTIZED;
    let apart: Vec<u8> = positions.iter().flat_map(|p| [p[0], p[1], p[2], 0x5555]).flat_map(i16::to_le_bytes).collect();
    let view = glb.view(&apart, 8);
    let positions = glb.push(
        "accessors",
        json!({"bufferView": view, "componentType": SHORT, "type": "VEC3", "count": 4, "normalized": true}),
    );
    let normals: Vec<u8> =
        [QUANTIZED_NORMAL; 4].iter().flat_map(|n| [n[0], n[1], n[2], 0x55]).map(i8::cast_unsigned).collect();
    let view = glb.view(&normals, 4);
    let normals = glb.push(
        "accessors",
        json!({"bufferView": view, "componentType": BYTE, "type": "VEC3", "count": 4, "normalized": true}),
    );
    let view = glb.view(QUANTIZED_UV.as_flattened(), 0);
    let uvs = glb.push(
        "accessors",
        json!({"bufferView": view, "componentType": UNSIGNED_BYTE, "type": "VEC2", "count": 4, "normalized": true}),
    );
    let indices = glb.indices(&SQUARE_INDICES);
    let attributes = json!({"POSITION": positions, "NORMAL": normals, "TEXCOORD_0": uvs});
    let mesh = mesh(&mut glb, json!({"attributes": attributes, "indices": indices}));
    glb.root(json!({"mesh": mesh, "scale": [scale, scale, scale]}));
    glb
}

/// Texels that all differ.
#[must_use]
pub fn texel(x: u32, y: u32) -> [u8; 4] {
    [(40 + 25 * x) as u8, (30 + 27 * y) as u8, (20 + 13 * ((5 * x + 3 * y) % 16)) as u8, 255]
}

fn texture_transform() -> image::ImageResult<Glb> {
    let mut glb = Glb::default();
    glb.uses("KHR_texture_transform");
    let texture = glb.texture("chequers", &png(8, 8, texel)?);
    let (offset, rotation, scale) = TRANSFORM;
    let transform = json!({"offset": offset, "rotation": rotation, "scale": scale});
    let map = json!({"index": texture, "extensions": {"KHR_texture_transform": transform}});
    square_of(
        &mut glb,
        json!({"name": "turned", "pbrMetallicRoughness": {"baseColorTexture": map, "metallicFactor": 0}}),
    );
    Ok(glb)
}

/// Alpha of a column of the mask.
#[must_use]
pub const fn mask_alpha(x: u32) -> u8 {
    (x * 17) as u8
}

fn alpha_mask() -> image::ImageResult<Glb> {
    let mut glb = Glb::default();
    let texture = glb.texture("ramp", &png(16, 2, |x, _| [200, 180, 160, mask_alpha(x)])?);
    let sampler = glb.push("samplers", json!({"wrapS": 33071, "wrapT": 33648}));
    let image = 0;
    let held = glb.push("textures", json!({"source": image, "sampler": sampler}));
    debug_assert_eq!(texture + 1, held);
    let pbr = json!({"baseColorTexture": {"index": held}, "metallicFactor": 0});
    square_of(
        &mut glb,
        json!({"name": "cut", "alphaMode": "MASK", "alphaCutoff": CUTOFF, "pbrMetallicRoughness": pbr}),
    );
    Ok(glb)
}

/// The same colours by three types, each square a unit further along x.
fn vertex_colours() -> Glb {
    let mut glb = Glb::default();
    let pbr =
        json!({"baseColorFactor": [COLOURED_BASE[0], COLOURED_BASE[1], COLOURED_BASE[2], 1], "metallicFactor": 0});
    let material = glb.push("materials", json!({"name": "painted", "pbrMetallicRoughness": pbr}));
    let floats = glb.floats(&COLOURS);
    let bytes: Vec<u8> =
        COLOURS.iter().flat_map(|c| [c[0], c[1], c[2], 0.5]).map(|c| (c * 255.0).round() as u8).collect();
    let shorts: Vec<u8> = COLOURS.iter().flatten().flat_map(|c| ((c * 65535.0).round() as u16).to_le_bytes()).collect();
    let shares = |glb: &mut Glb, bytes: &[u8], component: u32, kind: &str| {
        let view = glb.view(bytes, 0);
        glb.push(
            "accessors",
            json!({"bufferView": view, "componentType": component, "type": kind, "count": 4, "normalized": true}),
        )
    };
    let bytes = shares(&mut glb, &bytes, UNSIGNED_BYTE, "VEC4");
    let shorts = shares(&mut glb, &shorts, UNSIGNED_SHORT, "VEC3");
    let primitive = with(square(&mut glb), "material", json!(material));
    for (place, colours) in [floats, bytes, shorts].into_iter().enumerate() {
        let mut primitive = primitive.clone();
        primitive["attributes"]["COLOR_0"] = json!(colours);
        let mesh = mesh(&mut glb, primitive);
        glb.root(json!({"mesh": mesh, "translation": [place, 0, 0]}));
    }
    glb
}

fn emissive_strength() -> Glb {
    let mut glb = Glb::default();
    glb.uses("KHR_materials_emissive_strength");
    let (factor, strength) = EMISSION;
    let extension = json!({"KHR_materials_emissive_strength": {"emissiveStrength": strength}});
    let pbr = json!({"baseColorFactor": [0, 0, 0, 1], "metallicFactor": 0});
    square_of(
        &mut glb,
        json!({"name": "lamp", "emissiveFactor": factor, "extensions": extension, "pbrMetallicRoughness": pbr}),
    );
    glb
}

fn lights() -> Glb {
    let mut glb = Glb::default();
    let pbr = json!({"baseColorFactor": [0.8, 0.8, 0.8, 1], "metallicFactor": 0});
    square_of(&mut glb, json!({"name": "white", "pbrMetallicRoughness": pbr}));
    let (at, point, (spot, [inner, outer]), sun) = LIGHTS;
    let [spot_direction, sun_direction] = SHINE.map(DVec3::from);
    let at = DVec3::from(at);
    glb.light(
        "lamp",
        at,
        DVec3::NEG_Z,
        json!({"type": "point", "intensity": point * LUMENS_PER_WATT, "color": [1, 0.5, 0.25]}),
    );
    let cone = json!({"innerConeAngle": inner.to_radians(), "outerConeAngle": outer.to_radians()});
    glb.light("beam", at, spot_direction, json!({"type": "spot", "intensity": spot * LUMENS_PER_WATT, "spot": cone}));
    glb.light("sun", at, sun_direction, json!({"type": "directional", "intensity": sun * LUMENS_PER_WATT}));
    let (position, look_at, fov) = CAMERA;
    glb.camera("front", position.into(), look_at.into(), fov);
    glb
}

fn metal() -> image::ImageResult<Glb> {
    let mut glb = Glb::default();
    let (metallic, roughness, scale) = METAL;
    let data = glb.texture("metal and roughness", &png(8, 8, texel)?);
    let normals = glb.texture("waves", &png(8, 8, |x, _| [[96, 128, 160, 128][x as usize % 4], 128, 240, 255])?);
    let pbr = json!({
        "baseColorFactor": [0.9, 0.7, 0.4, 1], "metallicFactor": metallic, "roughnessFactor": roughness,
        "metallicRoughnessTexture": {"index": data},
    });
    square_of(
        &mut glb,
        json!({"name": "metal", "pbrMetallicRoughness": pbr, "normalTexture": {"index": normals, "scale": scale}}),
    );
    Ok(glb)
}
