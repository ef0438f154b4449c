//! Light that outlives an engine: what a later one begins with, and what broken blocks do to it.
#![allow(clippy::expect_used, reason = "a failed expectation fails the test")]

use crate::corridor::{Run, difference};
use glam::Vec3;
use penombre::math::content_hash::ContentHash;
use penombre::scene::content::Content;
use penombre::scene::light::LightState;
use penombre::store::{BlockKey, Limits, Store, Use};
use std::path::Path;
use std::sync::Arc;

/// Where the camera stands, and how far ahead it looks.
const PLACE: (f32, f32) = (-2.5, -0.6);

fn run(directory: &Path) -> Run {
    let mut run = Run::new(2);
    let store = Store::open(directory, Limits::default()).expect("a store");
    run.engine.keep_in(Arc::new(store), &Content::of(&run.scene));
    run
}

/// Looks, works, and says what is shown and how many rays that took.
fn stay(run: &mut Run, batches: usize) -> (Vec<Vec3>, u64) {
    let visible = run.turn(PLACE.0, PLACE.1);
    run.work(batches);
    run.mirror.apply(run.engine.settle());
    run.engine.cache().validate();
    (run.shown(&visible), run.mirror.last.stats.rays)
}

#[test]
fn an_engine_shows_at_once_what_the_one_before_it_had_found() {
    let folder = tempfile::tempdir().expect("a folder");
    let (shown, rays) = stay(&mut run(folder.path()), 60);
    let mut again = run(folder.path());
    let (at_once, traced) = stay(&mut again, 2);
    let off = difference(&at_once, &shown);
    let (coarse, _) = stay(&mut Run::new(2), 2);
    println!("off by {off} after {traced} of {rays} rays, {} without", difference(&coarse, &shown));
    assert!(off < 0.01 && off < difference(&coarse, &shown) / 5.0, "{off}");
    // What both found is kept: a third begins where the second ended.
    let (further, _) = stay(&mut again, 40);
    drop(again);
    let (third, _) = stay(&mut run(folder.path()), 2);
    assert!(difference(&third, &further) < 0.01);
}

#[test]
fn light_under_other_states_of_the_lights_is_not_kept() {
    let folder = tempfile::tempdir().expect("a folder");
    let (shown, _) = stay(&mut run(folder.path()), 60);
    {
        let mut edited = run(folder.path());
        let visible = edited.turn(PLACE.0, PLACE.1);
        let dark = [LightState::times(Vec3::splat(0.01)), LightState::default()];
        edited.mirror.apply(edited.engine.relight(&dark, &visible));
        edited.work(60);
    }
    let (after, _) = stay(&mut run(folder.path()), 2);
    let off = difference(&after, &shown);
    assert!(off < 0.01, "{off}");
}

/// What an engine knows after it has begun with the same kept light is the same, however many threads trace.
#[test]
fn engines_that_begin_with_the_same_light_know_the_same() {
    let folder = tempfile::tempdir().expect("a folder");
    stay(&mut run(folder.path()), 30);
    let file = folder.path().join("light.redb");
    let kept = std::fs::read(&file).expect("what was kept");
    let digests = [1, 2, 7].map(|threads| {
        std::fs::write(&file, &kept).expect("written");
        let mut run = Run::new(threads);
        let store = Store::open(folder.path(), Limits::default()).expect("a store");
        run.engine.keep_in(Arc::new(store), &Content::of(&run.scene));
        let (_, rays) = stay(&mut run, 10);
        (run.engine.cache().digest(), rays)
    });
    for (digest, rays) in &digests[1..] {
        assert!(digest.first_difference(&digests[0].0).is_none() && *rays == digests[0].1, "{rays} rays");
    }
    assert!(Run::new(1).engine.cache().digest().first_difference(&digests[0].0).is_some());
}

/// SplitMix64.
struct Random(u64);

impl Random {
    fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ self.0 >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ z >> 31) % n as u64) as usize
    }
}

/// Bytes with something else in a few places.
fn broken(mut bytes: Vec<u8>, random: &mut Random) -> Vec<u8> {
    for _ in 0..1 + random.below(4) {
        if bytes.is_empty() {
            return bytes;
        }
        let at = random.below(bytes.len());
        match random.below(6) {
            0 => bytes[at] ^= 1 << random.below(8),
            1 => bytes[at] = random.below(256) as u8,
            2 => bytes.truncate(at),
            3 => bytes.splice(at..at, [0xff; 4]).for_each(drop),
            4 => bytes[at..].iter_mut().take(4).for_each(|byte| *byte = [0, 0xff, 0x7f][at % 3]),
            _ => {
                let to = random.below(bytes.len());
                let count = 8.min(bytes.len() - at.max(to));
                bytes.copy_within(at..at + count, to);
            }
        }
    }
    bytes
}

/// Blocks whose checksums hold and whose contents make no sense: of another program, or of a fault before they were written.
fn blocks_that_make_no_sense(cases: std::ops::Range<u64>) {
    let folder = tempfile::tempdir().expect("a folder");
    let content = { Content::of(&Run::new(1).scene) };
    stay(&mut run(folder.path()), 30);
    let layers = [
        content.shape_key(),
        content.direct_key(&[0]),
        content.direct_key(&[1]),
        content.indirect_key(penombre::estimate::hemisphere::Method::default().name()),
    ];
    let whole: Vec<(BlockKey, Vec<u8>)> = {
        let store = Store::open(folder.path(), Limits::default()).expect("a store");
        let keys = layers.iter().flat_map(|&layer| (0..200).map(move |cluster| BlockKey { layer, cluster }));
        keys.filter_map(|key| Some((key, store.read(key)?))).collect()
    };
    assert!(whole.len() > 40, "{} blocks", whole.len());
    for case in cases {
        let mut random = Random(case);
        {
            let store = Store::open(folder.path(), Limits::default()).expect("a store");
            store.begin(Use { layers: layers.to_vec(), note: Vec::new() });
            let mut shapes = std::collections::BTreeMap::new();
            let blocks = whole.iter().map(|(key, bytes)| {
                let is_shape = key.layer == layers[0];
                // Blocks go by the shape that they were written with: most are to get that far.
                let (head, rest) = if is_shape {
                    (Vec::new(), bytes.clone())
                } else {
                    (Vec::clone(&shapes[&key.cluster]), bytes[8..].to_vec())
                };
                let rest = if random.below(3) == 0 { broken(rest, &mut random) } else { rest };
                if is_shape {
                    let mut hash = ContentHash::new("block");
                    hash.bytes(&rest);
                    shapes.insert(key.cluster, hash.finish().to_le_bytes().to_vec());
                }
                (*key, [head, rest].concat())
            });
            store.write(blocks.collect::<Vec<_>>());
        }
        let mut run = run(folder.path());
        let (shown, _) = stay(&mut run, 6);
        assert!(shown.iter().all(|d| d.is_finite()), "case {case}");
    }
}

#[test]
fn blocks_that_make_no_sense_break_nothing() {
    blocks_that_make_no_sense(0..12);
}

/// cargo test --release --test engine -- --ignored thousands_of_blocks
#[test]
#[ignore = "takes minutes"]
fn thousands_of_blocks_that_make_no_sense() {
    blocks_that_make_no_sense(100..1100);
}
