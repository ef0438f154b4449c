//! What the cache's memory goes to.

use super::drawn_mesh::DrawnRecord;
use super::ids::{Link, NodeId};
use super::pool::map_bytes;
use super::slot::SlotRecord;
use super::store::Cache;
use super::topology::Node;
use super::vertex::Vertex;

// A regular mesh has 4/3 nodes, half a vertex, half a slot and a drawn triangle a leaf: these and the edges are to take less than 300
// bytes. A field that makes a record larger takes megabytes in a scene of a million leaves.
const _: () = assert!(size_of::<Vertex>() <= 72);
const _: () = assert!(size_of::<SlotRecord>() <= 44);
const _: () = assert!(size_of::<Node>() <= 68);
const _: () = assert!(size_of::<DrawnRecord>() <= 40);
const _: () = assert!(size_of::<Link<NodeId>>() == 4);

/// What memory is held for, with the bytes.
pub type Part = (&'static str, usize);

impl Cache {
    /// Bytes held by the cache's structures.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.bytes_by_part().iter().map(|(_, bytes)| bytes).sum()
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
