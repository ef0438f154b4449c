//! How many pixels each drawn leaf covers: a histogram of the leaf-id image.

use super::mesh::LuminanceMesh;
use crate::refine::update::{LeafId, LeafPixels};
use crate::scene::camera::View;
use glam::Vec2;

/// Pixels of the leaves, as the luminance images show them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LeafCounts {
    /// Leaves with pixels, by id. Pixels that show another face than the id image do not count.
    pub leaves: Vec<LeafPixels>,
    /// Pixels of visible faces that no leaf covers; neighbours stand in for them.
    pub uncovered: u32,
}

/// Counters, kept between frames: a table of all leaves costs 0.1 to 0.4 ms where a sorted map costs several.
#[derive(Default)]
pub(super) struct Histogram {
    /// Pixels of each leaf, and the first of them; zero between calls.
    counters: Vec<Counter>,
}

#[derive(Clone, Copy, Default)]
struct Counter {
    pixels: u32,
    first: usize,
}

/// Neighbouring pixels that show the same leaf of the same face.
#[derive(Clone, Copy, Default)]
struct Run {
    /// Leaf and face, plus 1.
    leaf: u32,
    face: u32,
    counter: Counter,
}

impl Histogram {
    /// Counts; `leaves` and `faces` hold leaf and face of each pixel, plus 1, in rows of the view's width. Rays pass through
    /// the pixels' centres + `jitter`.
    pub(super) fn count(
        &mut self,
        (leaves, faces): (&[u32], &[u32]),
        mesh: &LuminanceMesh,
        (view, jitter): (&View, Vec2),
    ) -> LeafCounts {
        let mut counts = LeafCounts::default();
        // Neighbours mostly are alike: what they are is looked up once a run.
        let mut run = Run::default();
        for (pixel, (&leaf, &face)) in leaves.iter().zip(faces).enumerate() {
            if (leaf, face) != (run.leaf, run.face) {
                self.add(run, mesh, &mut counts);
                run = Run { leaf, face, counter: Counter { pixels: 0, first: pixel } };
            }
            run.counter.pixels += 1;
        }
        self.add(run, mesh, &mut counts);
        let ray = |pixel: usize| view.direction(view.size.centre_of(pixel) + jitter);
        let counted = self.counters.iter_mut().zip(0..).filter(|(counter, _)| counter.pixels > 0);
        counts.leaves.extend(counted.map(|(counter, leaf)| {
            let Counter { pixels, first } = std::mem::take(counter);
            LeafPixels { leaf: LeafId(leaf), pixels, ray: Some(ray(first)) }
        }));
        counts
    }

    fn add(&mut self, run: Run, mesh: &LuminanceMesh, counts: &mut LeafCounts) {
        let Counter { pixels, first } = run.counter;
        match (run.leaf.checked_sub(1), run.face.checked_sub(1)) {
            (_, None) => {}
            (None, _) => counts.uncovered += pixels,
            // A leaf that is drawn no more has kept pixels in cracks between those that replaced it.
            (Some(leaf), Some(face)) if mesh.is_drawn(leaf) && mesh.leaves.get(leaf).face == face => {
                let index = leaf as usize;
                if index >= self.counters.len() {
                    self.counters.resize(index + 1, Counter::default());
                }
                let counter = &mut self.counters[index];
                if counter.pixels == 0 {
                    counter.first = first;
                }
                counter.pixels += pixels;
            }
            _ => {}
        }
    }
}
