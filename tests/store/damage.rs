//! Damaged files: what comes back is what went in, or nothing; never a panic.

use crate::support::{Random, block, key, open, round_of};
use redb::ReadableTable as _;
use std::fs;
use std::path::Path;

const BLOCKS: u32 = 60;

/// A file with three layers of blocks, written in three rounds.
fn filled(directory: &Path) -> Vec<u8> {
    let store = open(directory);
    for round in 1..=3 {
        for layer in 1..=3 {
            store.write((0..BLOCKS / 3).map(|c| (key(layer, c), block(key(layer, c), round))));
        }
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    drop(store);
    fs::read(directory.join("light.redb")).unwrap()
}

/// One kind of damage after the other.
fn damage(file: &mut Vec<u8>, kind: u64, random: &mut Random) {
    let length = file.len();
    let at = random.below(length);
    match kind % 7 {
        // A bit flipped anywhere, and in what describes the file.
        0 => file[at] ^= 1 << random.below(8),
        1 => file[at % 4096.min(length)] ^= 1 << random.below(8),
        2 => file.truncate(at),
        // A sector that the disk lost, or gave to another file.
        3 => file[at / 512 * 512..].iter_mut().take(512).for_each(|byte| *byte = 0),
        4 => file[at / 4096 * 4096..].iter_mut().take(4096).for_each(|byte| *byte = random.next() as u8),
        // The beginning of a page, where its own numbers are.
        5 => (0..4).for_each(|_| file[(at / 4096 * 4096 + random.below(64)).min(length - 1)] = random.next() as u8),
        _ => {
            let (from, to) = (at / 4096 * 4096, random.below(length) / 4096 * 4096);
            let count = 4096.min(length - from.max(to));
            file.copy_within(from..from + count, to);
        }
    }
}

/// Opens a damaged file and looks at all of it: how many blocks came back.
fn survivors(directory: &Path) -> u32 {
    let store = open(directory);
    let mut there = 0;
    for layer in 1..=3 {
        for c in 0..BLOCKS / 3 {
            if let Some(bytes) = store.read(key(layer, c)) {
                assert!((1..=3).contains(&round_of(key(layer, c), &bytes)));
                there += 1;
            }
        }
    }
    store.write([(key(1, 1), block(key(1, 1), 3))]);
    assert_eq!(round_of(key(1, 1), &store.read(key(1, 1)).unwrap()), 3);
    let (saved, warnings) = store.close();
    assert_eq!(saved.blocks, 1, "it can be written to: {warnings:?}");
    assert!(there == BLOCKS || !warnings.is_empty(), "what is lost is told");
    there
}

fn damaged(cases: std::ops::Range<u64>) {
    let folder = tempfile::tempdir().unwrap();
    let whole = filled(folder.path());
    let mut random = Random(cases.start);
    let mut lost = 0;
    for case in cases {
        let directory = folder.path().join(format!("{case}"));
        fs::create_dir(&directory).unwrap();
        let mut file = whole.clone();
        damage(&mut file, case, &mut random);
        fs::write(directory.join("light.redb"), &file).unwrap();
        lost += u32::from(survivors(&directory) < BLOCKS);
        fs::remove_dir_all(directory).unwrap();
    }
    assert!(lost > 10, "the damage is felt in {lost} cases");
}

#[test]
fn damaged_files_give_back_what_went_in_or_nothing() {
    damaged(0..140);
}

/// The same for as long as one likes: cargo test --release --test store -- --ignored thousands
#[test]
#[ignore = "takes a minute"]
fn thousands_of_damaged_files() {
    damaged(1000..5000);
}

#[test]
fn files_that_never_were_a_store_are_put_aside() {
    for content in [&b""[..], b"redb", b"SQLite format 3\0 and so on", &[0xff; 100_000], &[0; 100_000]] {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("light.redb"), content).unwrap();
        let store = open(folder.path());
        store.write([(key(1, 1), vec![1])]);
        let (saved, warnings) = store.close();
        assert_eq!(saved.blocks, 1, "{warnings:?}");
        let aside = folder.path().join("light.redb.damaged");
        if content.is_empty() {
            assert!(warnings.is_empty() && !aside.exists(), "an empty file is a new one");
        } else {
            assert!(warnings.len() == 1 && warnings[0].contains("the file is damaged"), "{warnings:?}");
            assert_eq!(fs::read(aside).unwrap(), content);
        }
    }
}

#[test]
fn a_block_whose_bytes_were_changed_under_a_whole_file_is_not_believed() {
    let folder = tempfile::tempdir().unwrap();
    drop({
        let store = open(folder.path());
        store.write((0..3).map(|c| (key(1, c), block(key(1, c), 1))));
        store
    });
    {
        // By redb itself, so that its own checksums hold.
        let database = redb::Database::open(folder.path().join("light.redb")).unwrap();
        let transaction = database.begin_write().unwrap();
        let blocks = redb::TableDefinition::<(u64, u32), &[u8]>::new("blocks");
        {
            let mut table = transaction.open_table(blocks).unwrap();
            let mut changed = table.get((1, 1)).unwrap().unwrap().value().to_vec();
            changed[100] ^= 4;
            table.insert((1, 1), &changed[..]).unwrap();
            let other = table.get((1, 0)).unwrap().unwrap().value().to_vec();
            table.insert((1, 2), &other[..]).unwrap();
        }
        transaction.commit().unwrap();
    }
    let store = open(folder.path());
    assert_eq!(round_of(key(1, 0), &store.read(key(1, 0)).unwrap()), 1);
    assert_eq!((store.read(key(1, 1)), store.read(key(1, 2))), (None, None));
    let (saved, warnings) = store.close();
    assert_eq!((saved.read, saved.damaged), (1, 2));
    assert!(warnings.len() == 1 && warnings[0].contains("blocks are damaged"), "{warnings:?}");
}
