//! What the cache's memory goes to.

use super::drawn_mesh::DrawnRecord;
use super::ids::{Link, NodeId};
use super::pool::map_bytes;
use super::slot::SlotRecord;
use super::store::Cache;
use super::topology::Node;
use super::vertex::Vertex;
use std::sync::Arc;

// A regular mesh has 4/3 nodes, half a vertex, half a slot and a drawn triangle a leaf: these and the edges are to take less than 300
// bytes. A field that makes a record larger takes megabytes in a scene of a million leaves.
const _: () = assert!(size_of::<Vertex>() <= 72);
const _: () = assert!(size_of::<SlotRecord>() <= 44);
const _: () = assert!(size_of::<Node>() <= 68);
const _: () = assert!(size_of::<DrawnRecord>() <= 40);
const _: () = assert!(size_of::<Link<NodeId>>() == 4);

/// Midpoints of a split that no neighbour has made yet.
const MIDPOINTS: usize = Places::OF_A_SPLIT.vertices;
/// Bytes of the lists of slots between others, and of what uses a slot.
const LISTS: usize = 40;
/// Bytes of what a vertex samples of a light, and of all else: a light vector where it gathers, highlights.
const SAMPLES_OF_A_LIGHT: usize = 3;
const SAMPLES: usize = 24;

/// What memory is held for, with the bytes.
pub type Part = (&'static str, usize);

/// Numbers of places of arenas.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Places {
    /// Of vertices.
    pub vertices: usize,
    /// Of slots.
    pub slots: usize,
    /// Of nodes.
    pub nodes: usize,
    /// Of drawn triangles.
    pub drawn: usize,
}

impl Places {
    /// What a split takes: each midpoint lies on the edges of two faces; triangles of neighbours are drawn anew, too, and those that
    /// they replace stay until the GPU has heard of it.
    pub const OF_A_SPLIT: Self = Self { vertices: 2, slots: 3, nodes: 4, drawn: 8 };
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

    /// Bytes of places that were given back and wait to be used again.
    #[must_use]
    pub fn free_bytes(&self) -> usize {
        self.vertices.free_places() * size_of::<Vertex>()
            + self.slots.free_places() * size_of::<SlotRecord>()
            + self.topology.nodes.free_places() * size_of::<Node>()
            + self.topology.free_edge_bytes()
            + self.drawn.triangles.free_places() * size_of::<DrawnRecord>()
            + self.between.free_bytes()
    }

    /// Bytes by which arenas grow for so many splits, each as if none of its midpoints were there, with these places: with what is
    /// sampled at the midpoints.
    #[must_use]
    pub fn growth(&self, splits: usize, added: &Places) -> usize {
        let of_layers = self.layers.len() * SAMPLES_OF_A_LIGHT + SAMPLES;
        let midpoints = MIDPOINTS * splits;
        added.vertices * size_of::<Vertex>()
            + midpoints * of_layers
            + added.slots * (size_of::<SlotRecord>() + LISTS)
            + added.nodes * size_of::<Node>()
            + self.topology.edge_growth([3 * splits, midpoints, 0])
            + added.drawn * size_of::<DrawnRecord>()
    }

    /// Places that arenas grow by for so many splits: tables go by them.
    #[must_use]
    pub fn places_added(&self, splits: usize) -> Places {
        let Places { vertices, slots, drawn, .. } = Places::OF_A_SPLIT;
        let one = |count: usize| [count * splits, 0, 0];
        Places {
            vertices: self.vertices.growth(one(vertices)),
            slots: self.slots.growth(one(slots)),
            nodes: self.topology.nodes.growth([0, 0, splits]),
            drawn: self.drawn.triangles.growth(one(drawn)),
        }
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
