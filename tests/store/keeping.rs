//! What goes in comes back, in the same run and in a later one.

use crate::support::{AT_ONCE, begun, block, key, open, round_of};
use penombre::store::Limits;
use std::time::{Duration, Instant};

#[test]
fn blocks_come_back_before_they_are_committed_and_in_a_later_run() {
    let folder = tempfile::tempdir().unwrap();
    let never = Limits { every: Duration::from_secs(3600), ..AT_ONCE };
    let store = begun(folder.path(), &[1], &[], never);
    assert_eq!(store.before().blocks, 0);
    store.write((0..20).map(|c| (key(1, c), block(key(1, c), 1))));
    store.write([(key(1, 7), block(key(1, 7), 2)), (key(2, 7), Vec::new())]);
    assert_eq!(store.saved().blocks, 0, "nothing is committed yet");
    assert_eq!(round_of(key(1, 7), &store.read(key(1, 7)).unwrap()), 2);
    let (saved, warnings) = store.close();
    assert_eq!((saved.blocks, warnings.len()), (21, 0));

    let store = begun(folder.path(), &[1, 9], &[], never);
    assert_eq!(store.before().blocks, 20, "of the layers that are asked for");
    for c in 0..20 {
        let bytes = store.read(key(1, c)).unwrap();
        assert_eq!(round_of(key(1, c), &bytes), if c == 7 { 2 } else { 1 });
    }
    assert_eq!(store.read(key(2, 7)), Some(Vec::new()));
    assert_eq!((store.read(key(1, 20)), store.read(key(3, 0))), (None, None));
    assert_eq!(store.close().0.read, 21);
}

#[test]
fn blocks_are_committed_while_the_run_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let soon = Limits { every: Duration::from_millis(50), ..AT_ONCE };
    let store = begun(folder.path(), &[], &[], soon);
    store.write([(key(1, 1), block(key(1, 1), 1))]);
    let start = Instant::now();
    while store.saved().blocks == 0 {
        assert!(start.elapsed() < Duration::from_secs(20), "nothing was committed");
        std::thread::sleep(Duration::from_millis(5));
    }
    assert!(start.elapsed() >= Duration::from_millis(30), "it waits for more");
}

#[test]
fn more_than_waits_at_once_is_told_and_kept_all_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let never = Limits { every: Duration::from_secs(3600), waiting: 100_000, ..AT_ONCE };
    let store = begun(folder.path(), &[], &[], never);
    let _ = store.before();
    assert!(store.has_room());
    store.write([(key(1, 1), vec![7; 200_000])]);
    // It is committed before its time, and then there is room again.
    let start = Instant::now();
    while !store.has_room() {
        assert!(start.elapsed() < Duration::from_secs(20));
        std::thread::sleep(Duration::from_millis(1));
    }
    assert_eq!(store.saved().blocks, 1);
}

#[test]
fn of_layers_that_no_run_uses_the_oldest_are_dropped_and_no_other() {
    let folder = tempfile::tempdir().unwrap();
    let run = |layer: u64, most: u64| {
        let limits = Limits { most, ..AT_ONCE };
        let store = begun(folder.path(), &[layer], &[layer as u8], limits);
        store.write((0..10).map(|c| (key(layer, c), vec![layer as u8; 10_000])));
        let (_, warnings) = store.close();
        assert!(warnings.is_empty(), "{warnings:?}");
    };
    (1..=4).for_each(|layer| run(layer, 1 << 30));
    run(1, 1 << 30);
    // There is room for three: 2 and 3 go, which were not used since.
    run(5, 310_000);
    let store = open(folder.path());
    let there: Vec<u64> = (1..=5).filter(|&layer| store.read(key(layer, 3)).is_some()).collect();
    assert_eq!(there, [1, 4, 5]);
    assert_eq!(store.before().notes, [[5], [1], [4], [3], [2], [1]], "the newest first");
}

#[test]
fn a_run_that_has_more_light_than_may_be_kept_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let limits = Limits { most: 50_000, ..AT_ONCE };
    let store = begun(folder.path(), &[1], &[], limits);
    for c in 0..10 {
        store.write([(key(1, c), vec![1; 10_000])]);
        std::thread::sleep(Duration::from_millis(20));
    }
    let (_, warnings) = store.close();
    assert_eq!(warnings.len(), 1, "{warnings:?}");
    assert!(warnings[0].contains("which is the most"), "{warnings:?}");
}
