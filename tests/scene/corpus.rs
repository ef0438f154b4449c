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
        let value = mix(!seed ^ i);
        if let Some(byte) = copy.get_mut(at) {
            *byte = if value & 1 == 0 { bytes[from] } else { (value >> 8) as u8 };
        }
    }
    copy
}

/// `make fuzz`: for so many seconds a target, copies of the corpus with bytes changed, moved, repeated or left out, none of which may
/// take longer than [`LONGEST`]. What breaks is written to the system's folder for temporary files before it is fed.
#[test]
#[ignore = "takes as long as PENOMBRE_FUZZ_SECONDS says, for each target"]
fn no_reader_breaks_for_long() {
    let seconds = std::env::var("PENOMBRE_FUZZ_SECONDS").ok().and_then(|s| s.parse().ok()).unwrap_or(10);
    let only = std::env::var("PENOMBRE_FUZZ_TARGET").ok();
    for target in drive::TARGETS.into_iter().filter(|target| only.as_deref().is_none_or(|only| only == *target)) {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fuzz/corpus").join(target);
        let mut files: Vec<_> = fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path()).collect();
        files.sort();
        let files: Vec<Vec<u8>> = files.iter().map(|path| fs::read(path).unwrap()).collect();
        let (start, mut runs, mut longest) = (Instant::now(), 0_u64, Duration::ZERO);
        let kept = std::env::temp_dir().join(format!("penombre-fuzz-{target}-{}", std::process::id()));
        while start.elapsed() < Duration::from_secs(seconds) {
            let seed = mix(runs ^ u64::from(std::process::id()) << 32);
            let input = spliced(&files, seed);
            fs::write(&kept, &input).unwrap();
            let one = Instant::now();
            drive::drive(target, &input);
            longest = longest.max(one.elapsed());
            assert!(longest < LONGEST, "{target}: {longest:?}: {}", kept.display());
            runs += 1;
        }
        fs::remove_file(&kept).unwrap();
        println!("{target}: {runs} executions in {:.0} s, the longest {longest:?}", start.elapsed().as_secs_f64());
    }
}

/// A file of the corpus, changed in a few places: bytes, numbers at the ends of their ranges, parts left out, repeated, or of another file.
fn spliced(files: &[Vec<u8>], seed: u64) -> Vec<u8> {
    const WORDS: [&[u8]; 12] = [
        b"nan",
        b"-1",
        b"1e39",
        b"4294967295",
        b"0",
        b"\xff\xff\xff\xff",
        b"\0\0\0\x80",
        b"\xff\x7f",
        b"[",
        b"\"",
        b"inf",
        b"\n",
    ];
    let mut state = seed;
    let mut below = |n: usize| {
        state = mix(state.wrapping_add(0x9e37_79b9_7f4a_7c15));
        (state % n.max(1) as u64) as usize
    };
    let mut bytes = files[below(files.len())].clone();
    for _ in 0..=below(6) {
        let at = below(bytes.len());
        let end = (at + 1 + below(24)).min(bytes.len());
        match below(6) {
            0 if !bytes.is_empty() => bytes[at] = below(256) as u8,
            1 if !bytes.is_empty() => bytes[at] ^= 1 << below(8),
            2 => drop(bytes.drain(at..end)),
            3 => {
                let part = bytes[at..end].to_vec();
                let to = below(bytes.len());
                bytes.splice(to..to, part);
            }
            4 => {
                let other = &files[below(files.len())];
                let from = below(other.len());
                let part = other[from..(from + 1 + below(64)).min(other.len())].to_vec();
                bytes.splice(at..end, part);
            }
            _ => {
                let word = WORDS[below(WORDS.len())];
                bytes.splice(at..end.min(at + word.len()), word.iter().copied());
            }
        }
    }
    bytes
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
