//! A binary glTF file in the making.

use glam::{DMat3, DQuat, DVec3};
use serde_json::{Map, Value, json};

/// Lumens of a watt, by which glTF's photometric lights are written.
pub const LUMENS_PER_WATT: f64 = 683.0;

/// Component types of accessors.
pub const BYTE: u32 = 5120;
pub const UNSIGNED_BYTE: u32 = 5121;
pub const SHORT: u32 = 5122;
pub const UNSIGNED_SHORT: u32 = 5123;
pub const UNSIGNED_INT: u32 = 5125;
pub const FLOAT: u32 = 5126;

/// A file: lists of what glTF has, and one buffer.
#[derive(Default)]
pub struct Glb {
    lists: Map<String, Value>,
    lights: Vec<Value>,
    extensions: Vec<&'static str>,
    roots: Vec<usize>,
    bin: Vec<u8>,
}

impl Glb {
    /// Appends to a list (`nodes`, `meshes` …) and returns the number.
    pub fn push(&mut self, list: &str, value: Value) -> usize {
        let entry = self.lists.entry(list).or_insert_with(|| json!([]));
        let Some(list) = entry.as_array_mut() else { return 0 };
        list.push(value);
        list.len() - 1
    }

    /// Notes that an extension is used.
    pub fn uses(&mut self, extension: &'static str) {
        if !self.extensions.contains(&extension) {
            self.extensions.push(extension);
        }
    }

    /// A node of the scene itself.
    pub fn root(&mut self, node: Value) -> usize {
        let number = self.push("nodes", node);
        self.roots.push(number);
        number
    }

    /// A buffer view of bytes, aligned to four; `stride` 0 for none.
    pub fn view(&mut self, bytes: &[u8], stride: usize) -> usize {
        self.bin.resize(self.bin.len().next_multiple_of(4), 0);
        let mut view = json!({"buffer": 0, "byteOffset": self.bin.len(), "byteLength": bytes.len()});
        if stride > 0 {
            view["byteStride"] = json!(stride);
        }
        self.bin.extend_from_slice(bytes);
        self.push("bufferViews", view)
    }

    /// An accessor to a view of its own.
    pub fn accessor(&mut self, bytes: &[u8], component: u32, kind: &str, count: usize) -> usize {
        let view = self.view(bytes, 0);
        self.push("accessors", json!({"bufferView": view, "componentType": component, "type": kind, "count": count}))
    }

    /// An accessor of vectors of floats.
    pub fn floats<const N: usize>(&mut self, values: &[[f32; N]]) -> usize {
        let bytes: Vec<u8> = values.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
        self.accessor(&bytes, FLOAT, ["SCALAR", "VEC2", "VEC3", "VEC4"][N - 1], values.len())
    }

    /// An accessor of positions, with the bounds that glTF asks for.
    pub fn positions(&mut self, values: &[[f32; 3]]) -> usize {
        let number = self.floats(values);
        let bound =
            |pick: fn(f32, f32) -> f32| [0, 1, 2].map(|k| values.iter().map(|v| v[k]).reduce(pick).unwrap_or(0.0));
        let accessor = &mut self.lists["accessors"][number];
        (accessor["min"], accessor["max"]) = (json!(bound(f32::min)), json!(bound(f32::max)));
        number
    }

    /// An accessor of indices of four bytes.
    pub fn indices(&mut self, values: &[u32]) -> usize {
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        self.accessor(&bytes, UNSIGNED_INT, "SCALAR", values.len())
    }

    /// A texture of an image in PNG, repeated.
    pub fn texture(&mut self, name: &str, png: &[u8]) -> usize {
        let view = self.view(png, 0);
        let image = self.push("images", json!({"name": name, "bufferView": view, "mimeType": "image/png"}));
        self.push("textures", json!({"source": image}))
    }

    /// A camera at `position` that looks at a point, `fov` degrees high.
    pub fn camera(&mut self, name: &str, position: DVec3, look_at: DVec3, fov: f64) -> usize {
        let perspective = json!({"yfov": fov.to_radians(), "znear": 0.01});
        let camera = self.push("cameras", json!({"name": name, "type": "perspective", "perspective": perspective}));
        let node = placed(name, position, look_at - position);
        self.root(with(node, "camera", json!(camera)))
    }

    /// A light of `KHR_lights_punctual`, at `position`, which shines along `direction`.
    pub fn light(&mut self, name: &str, position: DVec3, direction: DVec3, mut light: Value) -> usize {
        self.uses("KHR_lights_punctual");
        light["name"] = json!(name);
        self.lights.push(light);
        let reference = json!({"KHR_lights_punctual": {"light": self.lights.len() - 1}});
        self.root(with(placed(name, position, direction), "extensions", reference))
    }

    /// The file.
    #[must_use]
    pub fn bytes(&self) -> Vec<u8> {
        let mut root = json!({
            "asset": {"version": "2.0", "generator": "make-scenes of Penombre; MIT OR Apache-2.0"},
            "scene": 0, "scenes": [{"nodes": self.roots}],
            "buffers": [{"byteLength": self.bin.len()}],
        });
        for (name, list) in &self.lists {
            root[name] = list.clone();
        }
        if !self.lights.is_empty() {
            root["extensions"] = json!({"KHR_lights_punctual": {"lights": self.lights}});
        }
        if !self.extensions.is_empty() {
            root["extensionsUsed"] = json!(self.extensions);
        }
        assemble(root.to_string().into_bytes(), self.bin.clone())
    }
}

/// A binary file of its two chunks.
#[must_use]
pub fn assemble(mut text: Vec<u8>, mut bin: Vec<u8>) -> Vec<u8> {
    text.resize(text.len().next_multiple_of(4), b' ');
    bin.resize(bin.len().next_multiple_of(4), 0);
    let word = |n: usize| (n as u32).to_le_bytes();
    let mut out = b"glTF\x02\0\0\0".to_vec();
    out.extend(word(12 + 8 + text.len() + 8 + bin.len()));
    out.extend(word(text.len()));
    out.extend(b"JSON");
    out.extend(text);
    out.extend(word(bin.len()));
    out.extend(b"BIN\0");
    out.extend(bin);
    out
}

/// An object with one more key.
#[must_use]
pub fn with(mut object: Value, key: &str, value: Value) -> Value {
    object[key] = value;
    object
}

/// A node whose −z points along `direction`, with y as far up as it can be.
fn placed(name: &str, position: DVec3, direction: DVec3) -> Value {
    let back = -direction.normalize();
    let right = DVec3::Y.cross(back).try_normalize().unwrap_or(DVec3::X);
    let turn = DQuat::from_mat3(&DMat3::from_cols(right, back.cross(right), back));
    json!({"name": name, "translation": position.to_array(), "rotation": turn.to_array()})
}
