//! Processes that are killed while they save: what they leave opens at once, and is the old state or the new.

use crate::support::{Random, block, key, open, round_of};
use std::io::{BufRead as _, BufReader};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

const DIRECTORY: &str = "PENOMBRE_TEST_STORE";
const FROM: &str = "PENOMBRE_TEST_FROM";
/// Clusters of a layer; a round writes some of one layer.
const CLUSTERS: u32 = 40;

/// Clusters that a round writes, and their layer.
fn written(round: u64) -> (u64, Vec<u32>) {
    let mut random = Random(round);
    let first = random.below(CLUSTERS as usize) as u32;
    (1 + round % 3, (0..10).map(|i| (first + i) % CLUSTERS).collect())
}

/// Not a test by itself: the process that is killed. It says which round it hands over and which are committed.
#[test]
fn saving_child() {
    let Ok(directory) = std::env::var(DIRECTORY) else { return };
    let from: u64 = std::env::var(FROM).unwrap().parse().unwrap();
    let store = open(directory.as_ref());
    let _ = store.before();
    let mut blocks = 0;
    for round in from..from + 100_000 {
        let (layer, clusters) = written(round);
        println!("\nwrites {round}");
        store.write(clusters.iter().map(|&c| (key(layer, c), block(key(layer, c), round))));
        blocks += clusters.len() as u64;
        while store.saved().blocks < blocks {
            std::thread::sleep(Duration::from_micros(200));
        }
        println!("\nsaved {round}");
    }
}

/// Kills a process that saves from a round on; which round it began last, and which it saw committed.
fn kill_one(directory: &Path, from: u64, after: Duration) -> (u64, u64) {
    let mut child = Command::new(std::env::current_exe().unwrap())
        .args(["kills::saving_child", "--exact", "--nocapture"])
        .env(DIRECTORY, directory)
        .env(FROM, from.to_string())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    std::thread::sleep(after);
    child.kill().unwrap();
    child.wait().unwrap();
    let (mut begun, mut saved) = (from - 1, from - 1);
    for line in BufReader::new(child.stdout.take().unwrap()).lines().map_while(Result::ok) {
        let number = |word: &str| line.strip_prefix(word).and_then(|rest| rest.parse().ok());
        begun = number("writes ").unwrap_or(begun);
        saved = number("saved ").unwrap_or(saved);
    }
    (begun, saved)
}

/// Looks at all blocks: each must be of the last round before `end` that wrote it; the number of rounds that are there.
fn check(directory: &Path, saved: u64, begun: u64) -> u64 {
    let store = open(directory);
    let rounds: Vec<Vec<u64>> = (1..=3)
        .map(|layer| {
            let of = |c| store.read(key(layer, c)).map_or(0, |bytes| round_of(key(layer, c), &bytes));
            (0..CLUSTERS).map(of).collect()
        })
        .collect();
    let newest = rounds.iter().flatten().copied().max().unwrap_or(0);
    assert!((saved..=begun.max(saved)).contains(&newest), "round {saved} was saved, {begun} begun, {newest} is there");
    // Every round up to the newest, and of none a part.
    let mut expected = vec![vec![0; CLUSTERS as usize]; 3];
    for round in 1..=newest {
        let (layer, clusters) = written(round);
        clusters.iter().for_each(|&c| expected[layer as usize - 1][c as usize] = round);
    }
    assert_eq!(rounds, expected);
    let (_, warnings) = store.close();
    assert!(warnings.is_empty(), "{warnings:?}");
    newest
}

fn kills(count: u32, seed: u64) {
    let folder = tempfile::tempdir().unwrap();
    let mut random = Random(seed);
    let (mut newest, mut in_a_commit, mut slowest) = (0, 0, Duration::ZERO);
    for _ in 0..count {
        let after = Duration::from_millis(10 + random.next() % 250);
        let (begun, saved) = kill_one(folder.path(), newest + 1, after);
        in_a_commit += u32::from(begun > saved);
        let start = Instant::now();
        let _ = open(folder.path()).before();
        slowest = slowest.max(start.elapsed());
        newest = check(folder.path(), saved, begun);
    }
    println!("{count} kills, {in_a_commit} while a round was saved, {newest} rounds; opened within {slowest:?}");
    assert!(newest > u64::from(count), "it got to save: {newest} rounds");
}

#[test]
fn killed_processes_leave_the_old_state_or_the_new() {
    kills(6, 1);
}

/// cargo test --release --test store -- --ignored --nocapture two_hundred_kills (make kills)
#[test]
#[ignore = "takes two minutes"]
fn two_hundred_kills() {
    kills(200, 2);
}
