//! Engines that may hold only so much: what is out of view goes to disk and comes back, and light is what it would be without a limit.
#![allow(clippy::expect_used, reason = "a failed expectation fails the test")]

use crate::corridor::{Run, difference};
use glam::Vec3;
use penombre::refine::engine::Visible;
use penombre::refine::memory::Memory;
use penombre::store::page_file::PageFile;
use std::collections::BTreeSet;

/// The ends of the corridor, from where nothing of the other is seen.
const ENDS: [(f32, f32); 2] = [(-2.5, -0.6), (2.5, 0.6)];

/// Whether what does not fit in is written to disk.
#[derive(Clone, Copy, PartialEq)]
enum Spills {
    Yes,
    No,
}

fn run(budget: Option<usize>, spills: Spills) -> Run {
    let mut run = Run::new(2);
    if let Some(budget) = budget {
        let file = match spills {
            Spills::Yes => PageFile::create(&std::env::temp_dir()),
            Spills::No => Err(std::io::Error::other("no file")),
        };
        run.engine.limit_memory(Memory::limited(budget, file));
    }
    run
}

/// Walks from one end to the other and back, so often; returns the rays of each stay, and what is shown at last.
fn walk(run: &mut Run, stays: usize) -> (Vec<u64>, Vec<Vec3>) {
    let mut rays = Vec::new();
    let mut shown = Vec::new();
    for stay in 0..stays {
        let before = run.mirror.last.stats.rays;
        let visible = run.turn(ENDS[stay % 2].0, ENDS[stay % 2].1);
        run.work(60);
        run.mirror.apply(run.engine.settle());
        rays.push(run.mirror.last.stats.rays - before);
        shown = run.shown(&visible);
        run.engine.cache().validate();
    }
    (rays, shown)
}

/// What the first stay holds.
fn needed() -> usize {
    let mut run = run(None, Spills::No);
    walk(&mut run, 1);
    run.mirror.last.stats.memory.held as usize
}

/// Rays gathered at the corners of what a view shows, and its leaves.
fn known(run: &Run, visible: &Visible) -> (u64, usize) {
    let cache = run.engine.cache();
    let mut leaves = Vec::new();
    let roots = visible.faces.iter().filter_map(|(face, _)| cache.root_of(*face));
    roots.for_each(|root| cache.topology.leaves(root, &mut leaves));
    let corners: BTreeSet<_> = leaves.iter().flat_map(|&leaf| cache.corner_vertices(leaf)).collect();
    (corners.iter().map(|&vertex| u64::from(cache.indirect.rays(vertex))).sum(), leaves.len())
}

#[test]
fn what_was_evicted_comes_back_from_disk_as_it_was() {
    let mut run = run(Some(needed() * 6 / 5), Spills::Yes);
    let (there, ahead) = ENDS[0];
    let first = run.turn(there, ahead);
    run.work(40);
    run.mirror.apply(run.engine.settle());
    let (before, shown) = (known(&run, &first), run.shown(&first));
    for _ in 0..2 {
        run.turn(ENDS[1].0, ENDS[1].1);
        run.work(40);
        let stats = run.mirror.last.stats;
        assert!(stats.memory.held <= stats.memory.budget, "{stats:?}");
    }
    let gone = known(&run, &first).1;
    assert!(gone < before.1 * 3 / 4, "{gone} of {} leaves are still there", before.1);
    let again = run.turn(there, ahead);
    run.mirror.apply(run.engine.settle());
    let stats = run.mirror.last.stats;
    assert!(stats.memory.evicted > 100 && stats.memory.paged_in > 2, "{stats:?}");
    let after = known(&run, &again);
    assert!(after.0 >= before.0 && after.1 >= before.1, "{before:?} {after:?}");
    let off = difference(&run.shown(&again), &shown);
    assert!(off < 2e-3, "{off}");
    run.engine.cache().validate();
}

#[test]
fn without_a_disk_it_is_traced_again_and_shows_the_same() {
    let needed = needed();
    let mut free = run(None, Spills::No);
    let mut tight = run(Some(needed * 5 / 4), Spills::No);
    let ((_, all), (rays, traced)) = (walk(&mut free, 3), walk(&mut tight, 3));
    assert!(rays[2] > rays[0] / 4, "{rays:?}");
    let off = difference(&traced, &all);
    assert!(off < 0.02, "{off}");
}

#[test]
fn an_engine_with_too_little_for_its_view_comes_to_an_end() {
    let needed = needed();
    for share in [2, 10] {
        let mut free = run(None, Spills::No);
        let mut tight = run(Some(needed / share), Spills::Yes);
        let ((_, all), (_, coarse)) = (walk(&mut free, 2), walk(&mut tight, 2));
        for _ in 0..400 {
            tight.work(if tight.engine.is_idle() { 0 } else { 50 });
        }
        println!("1/{share}: {:?} {:?}", tight.mirror.last.stats, tight.engine.held());
        assert!(tight.engine.is_idle(), "nothing is left that there is room for");
        let off = difference(&coarse, &all);
        assert!(off < 0.2, "1/{share}: {off}");
        println!("1/{share}: off by {off}, {:?}", tight.mirror.last.stats);
    }
}

#[test]
fn one_thread_and_several_evict_the_same() {
    let needed = needed();
    let bits = |threads: usize| {
        let mut run = Run::new(threads);
        run.engine.limit_memory(Memory::limited(needed, PageFile::create(&std::env::temp_dir())));
        walk(&mut run, 4);
        let slots: Vec<[u32; 3]> =
            run.mirror.mesh.slots().map(|(_, slot)| slot.diffuse.to_array().map(f32::to_bits)).collect();
        (slots, run.mirror.last.stats.memory)
    };
    let one = bits(1);
    assert!(one.1.evicted > 0 && one == bits(3));
}
