//! Faults of disk and directory: a message, and the run goes on.

use crate::support::{AT_ONCE, begun, block, key, open, round_of};
use penombre::store::{Limits, Store};
use redb::ReadableDatabase as _;
use std::fs;
use std::process::Command;
use std::time::Duration;

#[test]
fn a_directory_that_is_removed_in_mid_run_is_a_warning() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cache");
    let store = open(&path);
    store.write([(key(1, 1), block(key(1, 1), 1))]);
    while store.saved().blocks == 0 {
        std::thread::sleep(Duration::from_millis(2));
    }
    fs::remove_dir_all(&path).unwrap();
    store.write([(key(1, 2), block(key(1, 2), 1))]);
    let (saved, warnings) = store.close();
    assert_eq!(saved.blocks, 1);
    assert!(warnings.len() == 1 && warnings[0].contains("it was removed or replaced meanwhile"), "{warnings:?}");
    assert!(!path.exists(), "nothing is left behind");
}

/// The file may not grow beyond a length, which the system would say of a full disk.
#[test]
fn a_full_disk_is_a_warning_and_what_was_kept_still_comes_back() {
    let folder = tempfile::tempdir().unwrap();
    let start = open(folder.path());
    start.write((0..10).map(|c| (key(1, c), block(key(1, c), 1))));
    drop(start);
    let small = Limits { most: 0, ..AT_ONCE };
    let store = begun(folder.path(), &[1], &[], small);
    store.write((0..3000).map(|c| (key(3, c), vec![1; 60_000])));
    let wait = std::time::Instant::now();
    while store.has_room() && wait.elapsed() < Duration::from_secs(20) {
        std::thread::sleep(Duration::from_millis(2));
    }
    for c in 0..10 {
        assert_eq!(store.read(key(1, c)).map(|bytes| round_of(key(1, c), &bytes)), Some(1), "{c}");
    }
    store.write([(key(1, 1), vec![1])]);
    let (saved, warnings) = store.close();
    assert_eq!(saved.blocks, 0);
    assert!(warnings.len() == 1 && warnings[0].contains("light cannot be saved: "), "{warnings:?}");
    let later = open(folder.path());
    assert_eq!(later.read(key(1, 1)).map(|bytes| round_of(key(1, 1), &bytes)), Some(1));
    assert!(later.close().1.is_empty());
}

#[test]
fn a_file_of_a_later_version_is_left_as_it_is() {
    let folder = tempfile::tempdir().unwrap();
    open(folder.path()).write([(key(1, 1), vec![1])]);
    let file = folder.path().join("light.redb");
    {
        let database = redb::Database::open(&file).unwrap();
        let transaction = database.begin_write().unwrap();
        let numbers = redb::TableDefinition::<&str, u64>::new("numbers");
        transaction.open_table(numbers).unwrap().insert("format", 99).unwrap();
        transaction.commit().unwrap();
    }
    let store = open(folder.path());
    assert_eq!(store.before().blocks, 0);
    store.write([(key(1, 1), vec![2])]);
    assert_eq!(store.read(key(1, 1)), None);
    let (_, warnings) = store.close();
    assert!(
        warnings.len() == 1 && warnings[0].contains("a later version of penombre wrote it (format 99)"),
        "{warnings:?}"
    );
    let database = redb::Database::open(&file).unwrap();
    let transaction = database.begin_read().unwrap();
    let format = transaction.open_table(redb::TableDefinition::<&str, u64>::new("numbers")).unwrap();
    assert_eq!(format.get("format").unwrap().unwrap().value(), 99);
    let blocks = transaction.open_table(redb::TableDefinition::<(u64, u32), &[u8]>::new("blocks")).unwrap();
    assert_eq!(blocks.get((1, 1)).unwrap().unwrap().value()[16..], [1]);
    assert!(!folder.path().join("light.redb.damaged").exists());
}

const DIRECTORY: &str = "PENOMBRE_TEST_STORE";

/// Not a test by itself: a process that tries to use the directory of another.
#[test]
fn second_process() {
    let Ok(directory) = std::env::var(DIRECTORY) else { return };
    let refused = Store::open(directory.as_ref(), AT_ONCE).err().unwrap();
    assert_eq!(refused.exit_status(), 2);
    println!("refused: {refused}");
}

#[test]
fn a_second_process_is_told_and_harms_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let store = open(folder.path());
    store.write([(key(1, 1), block(key(1, 1), 1))]);
    let output = Command::new(std::env::current_exe().unwrap())
        .args(["faults::second_process", "--exact", "--nocapture"])
        .env(DIRECTORY, folder.path())
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success() && said.contains("another process keeps its light there now"), "{said}");
    drop(store);
    assert_eq!(round_of(key(1, 1), &open(folder.path()).read(key(1, 1)).unwrap()), 1);
}
