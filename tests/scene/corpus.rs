//! What fuzzing has found worth keeping, fed once to each reader; and each file with some bytes changed. `make fuzz` goes on from here.

#[path = "../fuzz/drive.rs"]
mod drive;

use penombre::math::mix;
use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};

/// Longest that any file may take: they have a few thousand bytes, and take milliseconds where nothing else runs.
const LONGEST: Duration = Duration::from_secs(10);
/// Changed copies of each file.
const COPIES: u64 = 4;

/// A copy with a few bytes changed, some taken from elsewhere in the file.
fn changed(bytes: &[u8], seed: u64) -> Vec<u8> {
    let mut copy = bytes.to_vec();
    for i in 0..4 {
        let [at, from] = [0, 1].map(|k| (mix(seed * 16 + i * 2 + k) % bytes.len().max(1) as u64) as usize);
        let value = mix(!seed + i);
        if let Some(byte) = copy.get_mut(at) {
            *byte = if value & 1 == 0 { bytes[from] } else { (value >> 8) as u8 };
        }
    }
    copy
}

#[test]
fn no_reader_breaks_on_the_corpus() {
    for target in drive::TARGETS {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fuzz/corpus").join(target);
        let mut files: Vec<_> = fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path()).collect();
        files.sort();
        assert!(files.len() > 1, "{target}: {} files", files.len());
        for (path, number) in files.iter().zip(0..) {
            let bytes = fs::read(path).unwrap();
            let copies = (0..COPIES).map(|copy| changed(&bytes, number * COPIES + copy));
            for input in std::iter::once(bytes.clone()).chain(copies) {
                let start = Instant::now();
                drive::drive(target, &input);
                assert!(start.elapsed() < LONGEST, "{target}: {}: {:?}", path.display(), start.elapsed());
            }
        }
    }
}
