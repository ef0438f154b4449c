//! How many pixels each drawn leaf covers: a histogram of the leaf-id image.

use super::mesh::LuminanceMesh;
use crate::refine::update::LeafId;

/// Pixels of the leaves, as the luminance images show them.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LeafCounts {
    /// Leaves with pixels, by id. Pixels that show another face than the id image do not count.
    pub leaves: Vec<(LeafId, u32)>,
    /// Pixels of visible faces that no leaf covers; neighbours stand in for them.
    pub uncovered: u32,
}

/// Counters, kept between frames: a table of all leaves costs 0.1 to 0.4 ms where a sorted map costs several.
#[derive(Default)]
pub(super) struct Histogram {
    /// Pixels of each leaf; zero between calls.
    pixels: Vec<u32>,
}

impl Histogram {
    /// Counts; `leaves` and `faces` hold leaf and face of each pixel, plus 1.
    pub(super) fn count(&mut self, leaves: &[u32], faces: &[u32], mesh: &LuminanceMesh) -> LeafCounts {
        let mut counts = LeafCounts::default();
        // Neighbours mostly are alike: what they are is looked up once a run.
        let (mut run, mut length) = ((0, 0), 0);
        for (&leaf, &face) in leaves.iter().zip(faces) {
            if (leaf, face) == run {
                length += 1;
                continue;
            }
            self.add(run, length, mesh, &mut counts);
            (run, length) = ((leaf, face), 1);
        }
        self.add(run, length, mesh, &mut counts);
        let pixels = self.pixels.iter_mut().zip(0..).filter(|(pixels, _)| **pixels > 0);
        counts.leaves.extend(pixels.map(|(pixels, leaf)| (LeafId(leaf), std::mem::take(pixels))));
        counts
    }

    fn add(&mut self, (leaf, face): (u32, u32), pixels: u32, mesh: &LuminanceMesh, counts: &mut LeafCounts) {
        match (leaf.checked_sub(1), face.checked_sub(1)) {
            (_, None) => {}
            (None, _) => counts.uncovered += pixels,
            // A leaf that is drawn no more has kept pixels in cracks between those that replaced it.
            (Some(leaf), Some(face)) if mesh.is_drawn(leaf) && mesh.leaves.get(leaf).face == face => {
                let index = leaf as usize;
                if index >= self.pixels.len() {
                    self.pixels.resize(index + 1, 0);
                }
                self.pixels[index] += pixels;
            }
            _ => {}
        }
    }
}
