//! Whatever becomes of a sound glTF file, loading it ends: with a scene that keeps its promises or with a report.

#![allow(clippy::expect_used, reason = "a test may end where its files cannot be written")]

use super::fuzz::{runner, try_load};
use super::generated::generate::{glb::assemble, samples};
use super::gltf_broken::{buffer, sound};
use proptest::prelude::*;
use serde_json::{Value, json};

/// The samples and the sound file, as bytes.
fn files() -> Vec<Vec<u8>> {
    let samples = samples::files().expect("the samples").into_iter().map(|file| file.bytes);
    samples.chain([assemble(serde_json::to_vec(&sound()).expect("text"), buffer())]).collect()
}

/// The text and the binary part of a file.
fn parts(bytes: &[u8]) -> (Value, Vec<u8>) {
    let end = 20 + u32::from_le_bytes(bytes[12..16].try_into().expect("four bytes")) as usize;
    (serde_json::from_slice(&bytes[20..end]).expect("text"), bytes[end + 8..].to_vec())
}

#[test]
fn changed_bytes_never_break_the_loader() -> Result<(), TestCaseError> {
    let files = files();
    let change = (any::<prop::sample::Index>(), any::<u8>());
    let changes = (0..files.len(), prop::collection::vec(change, 1..8), any::<prop::sample::Index>(), any::<bool>());
    let run = runner(600).run(&changes, |(file, changes, end, cut)| {
        let mut bytes = files[file].clone();
        for (at, value) in changes {
            let at = at.index(bytes.len());
            bytes[at] = value;
        }
        if cut {
            bytes.truncate(end.index(bytes.len()));
        }
        try_load(&[("a.glb", &bytes)], "a.glb")
    });
    run.map_err(|e| TestCaseError::fail(e.to_string()))
}

/// How many values there are in a value, itself included.
fn count(value: &Value) -> usize {
    1 + match value {
        Value::Array(list) => list.iter().map(count).sum(),
        Value::Object(map) => map.values().map(count).sum(),
        _ => 0,
    }
}

/// Puts another value in the place of one, by its number.
fn replace(value: &mut Value, number: &mut usize, other: &Value) {
    if *number == 0 {
        *value = other.clone();
    }
    *number = number.wrapping_sub(1);
    match value {
        _ if *number > usize::MAX / 2 => {}
        Value::Array(list) => list.iter_mut().for_each(|value| replace(value, number, other)),
        Value::Object(map) => map.values_mut().for_each(|value| replace(value, number, other)),
        _ => {}
    }
}

fn any_value() -> impl Strategy<Value = Value> {
    let odd = vec![
        json!(null),
        json!(true),
        json!([]),
        json!({}),
        json!(""),
        json!("data:;base64,AAAA"),
        json!("MASK"),
        json!("BLEND"),
        json!("VEC3"),
        json!(u64::MAX),
        json!(u32::MAX),
        json!(-1),
        json!(1e39),
        json!(1e-40),
        json!(0.3),
        json!(1e30),
        json!([0, 0, 0]),
        json!([1e38, 1, 1, 1]),
        json!({"index": 0}),
        json!({"index": 9, "texCoord": 1}),
        json!([0, 1, 2, 3]),
        json!(5126),
        json!(5121),
        json!(5123),
        json!(5125),
    ];
    prop_oneof![2 => (0_u32..9).prop_map(|i| json!(i)), 3 => prop::sample::select(odd)]
}

#[test]
fn changed_values_never_break_the_loader() -> Result<(), TestCaseError> {
    let files: Vec<(Value, Vec<u8>)> = files().iter().map(|bytes| parts(bytes)).collect();
    let change = (any::<prop::sample::Index>(), any_value());
    let changes = (0..files.len(), prop::collection::vec(change, 1..4), any::<bool>());
    let run = runner(1500).run(&changes, |(file, changes, as_text)| {
        let (mut text, bin) = files[file].clone();
        for (at, value) in changes {
            let mut number = at.index(count(&text));
            replace(&mut text, &mut number, &value);
        }
        let text = text.to_string().into_bytes();
        if as_text {
            return try_load(&[("a.gltf", &text), ("a.bin", &bin)], "a.gltf");
        }
        try_load(&[("a.glb", &assemble(text, bin))], "a.glb")
    });
    run.map_err(|e| TestCaseError::fail(e.to_string()))
}
