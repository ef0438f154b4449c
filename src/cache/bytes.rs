//! What the cache's memory goes to.

use super::drawn_mesh::DrawnRecord;
use super::ids::{Link, NodeId};
use super::pool::map_bytes;
use super::slot::SlotRecord;
use super::store::Cache;
use super::topology::{Node, Topology};
use super::vertex::Vertex;
use std::sync::Arc;

// A regular mesh has 4/3 nodes, half a vertex, half a slot and a drawn triangle a leaf: these and the edges are to take less than 300
// bytes. A field that makes a record larger takes megabytes in a scene of a million leaves.
const _: () = assert!(size_of::<Vertex>() <= 72);
const _: () = assert!(size_of::<SlotRecord>() <= 44);
const _: () = assert!(size_of::<Node>() <= 68);
const _: () = assert!(size_of::<DrawnRecord>() <= 40);
const _: () = assert!(size_of::<Link<NodeId>>() == 4);

/// Edges inside a node that is split.
const INNER_EDGES: usize = 3;
/// Bytes of the lists of slots between others, and of what uses a slot.
const LISTS: usize = 40;
/// Bytes of what a vertex samples of a light, and of all else: a light vector where it gathers, highlights.
const SAMPLES_OF_A_LIGHT: usize = 3;
const SAMPLES: usize = 24;

/// What memory is held for, with the bytes.
pub type Part = (&'static str, usize);

/// Numbers of places of arenas.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Places {
    /// Of vertices.
    pub vertices: usize,
    /// Of slots.
    pub slots: usize,
    /// Of nodes.
    pub nodes: usize,
    /// Of edges.
    pub edges: usize,
    /// Of drawn triangles.
    pub drawn: usize,
}

impl Places {
    /// Bytes of these places in arenas.
    #[must_use]
    pub const fn bytes(&self) -> usize {
        self.vertices * size_of::<Vertex>()
            + self.slots * (size_of::<SlotRecord>() + LISTS)
            + self.nodes * size_of::<Node>()
            + self.edges * Topology::EDGE
            + self.drawn * size_of::<DrawnRecord>()
    }

    /// What a split takes: each midpoint lies on the edges of two faces; triangles of neighbours are drawn anew, too, and those that
    /// they replace stay until the GPU has heard of it.
    pub const OF_A_SPLIT: Self = Self { vertices: 2, slots: 3, nodes: 4, edges: INNER_EDGES + 4, drawn: 8 };
    /// What a new face takes.
    pub const OF_A_FACE: Self = Self { vertices: 1, slots: 2, nodes: 1, edges: 2, drawn: 2 };
}

impl Cache {
    /// Bytes held by the cache's structures.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.bytes_by_part().iter().map(|(_, bytes)| bytes).sum()
    }

    /// Has the radiance grid take no more than so many bytes.
    pub fn limit_radiance(&mut self, bytes: usize) {
        Arc::make_mut(&mut self.radiance).limit(bytes);
    }

    /// Bytes of samples at so many vertices, about.
    #[must_use]
    pub fn sample_bytes(&self, vertices: usize) -> usize {
        vertices * (self.layers.len() * SAMPLES_OF_A_LIGHT + SAMPLES)
    }

    /// Places that arenas grow by for so many faces and splits, each as if its neighbours were not there.
    #[must_use]
    pub fn places_added(&self, faces: usize, splits: usize) -> Places {
        let [face, split] = [Places::OF_A_FACE, Places::OF_A_SPLIT];
        let one = |of_a_face: usize, of_a_split: usize| [of_a_face * faces + of_a_split * splits, 0, 0];
        let halves = (split.edges - INNER_EDGES) / 2;
        Places {
            vertices: self.vertices.growth(one(face.vertices, split.vertices)),
            slots: self.slots.growth(one(face.slots, split.slots)),
            nodes: self.topology.nodes.growth([face.nodes * faces, 0, splits]),
            edges: self.topology.edges.growth([face.edges * faces + INNER_EDGES * splits, halves * splits, 0]),
            drawn: self.drawn.triangles.growth(one(face.drawn, split.drawn)),
        }
    }

    /// Places that can be used again.
    #[must_use]
    pub fn free_places(&self) -> Places {
        Places {
            vertices: self.vertices.free_places(),
            slots: self.slots.free_places(),
            nodes: self.topology.nodes.free_places(),
            edges: self.topology.edges.free_places(),
            drawn: self.drawn.triangles.free_places(),
        }
    }

    /// Makes the largest blocks of places that were given back and lie side by side.
    pub fn join_free(&mut self) {
        self.topology.nodes.join_free();
        self.topology.edges.join_free();
    }

    /// Bytes held, by what they are held for.
    #[must_use]
    pub fn bytes_by_part(&self) -> [Part; 13] {
        let Self { topology, drawn, layers, .. } = self;
        [
            ("vertices", self.vertices.bytes()),
            ("slots", self.slots.bytes()),
            ("slots between others", self.between.bytes()),
            ("nodes", topology.nodes.bytes()),
            ("edges", topology.edge_bytes()),
            ("drawn triangles", drawn.bytes()),
            ("visibility", layers.iter().map(|layer| layer.visibility.bytes()).sum()),
            ("sums of area lights", layers.iter().map(|layer| layer.sums.bytes()).sum()),
            ("light vectors", self.indirect.bytes()),
            ("radiance grid", self.radiance.bytes()),
            ("priors", self.prior.bytes() + self.penumbrae.bytes() + self.expected.bytes()),
            ("coarse grids", self.coarse.bytes()),
            ("names of vertices and roots", map_bytes(&self.names) + map_bytes(&self.roots)),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::super::ids::SlotId;
    use super::super::layer::Layer;
    use super::super::testing::{Rooted, square};
    use crate::estimate::visibility::Visibility;

    /// A square of 8,192 leaves that are drawn, lit by one light of which each vertex has tried sixteen points.
    fn refined() -> Rooted {
        let mut square = square();
        while square.leaves().len() < 8192 {
            square.leaves().into_iter().for_each(|leaf| _ = square.cache.split(leaf));
        }
        square.leaves().into_iter().for_each(|leaf| _ = square.cache.draw(leaf, None));
        let mut layer = Layer::default();
        let mut half = Visibility::default();
        (0..16).for_each(|point| half.push(point % 2 == 0));
        square.cache.vertices.ids().for_each(|vertex| layer.visibility.set(vertex, half));
        square.cache.layers.push(layer);
        square
    }

    #[test]
    fn a_leaf_takes_less_than_300_bytes() {
        let square = refined();
        square.cache.validate();
        let leaves = square.leaves().len();
        let bytes = square.cache.bytes() / leaves;
        assert!((200..300).contains(&bytes), "{bytes}: {:?}", square.cache.bytes_by_part());
    }

    #[test]
    fn parts_grow_with_what_they_hold() {
        let mut square = square();
        let part = |square: &Rooted, name: &str| {
            let parts = square.cache.bytes_by_part();
            parts.iter().find(|(part, _)| *part == name).map(|(_, bytes)| *bytes).expect(name)
        };
        let before = part(&square, "light vectors");
        square.gather(SlotId(0), &[1.0; 4]);
        assert!(part(&square, "light vectors") > before);
        let before = ["nodes", "edges", "vertices", "slots", "slots between others"].map(|name| part(&square, name));
        while square.leaves().len() < 1000 {
            square.leaves().into_iter().for_each(|leaf| _ = square.cache.split(leaf));
        }
        let after = ["nodes", "edges", "vertices", "slots", "slots between others"].map(|name| part(&square, name));
        assert!(before.iter().zip(after).all(|(before, after)| *before < after), "{before:?} {after:?}");
        assert_eq!(square.cache.bytes(), square.cache.bytes_by_part().iter().map(|(_, bytes)| bytes).sum::<usize>());
    }
}
